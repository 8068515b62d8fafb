"""Random limits for a design, and whether a motion keeps them, by other code than the design's."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import yaml
from numpy.typing import NDArray

from ident.excitation.design import DesignTask
from wamctl.arm.collision import collision_shapes
from wamctl.arm.config import ArmFile, LimitsSection
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory import Trajectory, trajectory_yaml
from wamctl.arm.trajectory_check import expected_friction

Array = NDArray[np.floating]

_ROUNDING = 1e-9


def random_arm(arm: ArmFile, rng: np.random.Generator) -> ArmFile:
    """The arm under limits of any size, most of them bad, for a motion of any tempo."""
    old, n = arm.limits, len(arm.robot.joints)

    def factors(low: float, high: float) -> Array:
        return 10 ** (rng.uniform(low, high) + rng.uniform(-0.5, 0.5, n))

    lower, upper = np.array(old.position_lower_rad), np.array(old.position_upper_rad)
    ends = np.sort(rng.uniform(lower, upper, (2, n)), axis=0)
    reach = {"position_lower_rad": ends[0], "position_upper_rad": ends[1]}
    scales = {
        "velocity_rad_s": factors(-2, 0.5),
        "acceleration_rad_s2": factors(-2, 0.5),
        "jerk_rad_s3": factors(-3, 0.5),
        "motor_torque_nm": factors(-0.7, 0.5),
        "motor_torque_slew_nm_s": factors(-4, 0.5),
    }
    changed = {
        name: tuple((np.array(getattr(old, name)) * scale).tolist())
        for name, scale in scales.items()
    }
    if rng.random() < 0.5:
        changed |= {name: tuple(value.tolist()) for name, value in reach.items()}
    changed |= {
        "elbow_speed_m_s": old.elbow_speed_m_s * 10 ** rng.uniform(-2, 0.3),
        "tool_speed_m_s": old.tool_speed_m_s * 10 ** rng.uniform(-2, 0.3),
        "clearance_m": rng.choice([0.0, 0.02, 0.05, 0.1, 0.2]),
    }
    excitation = {
        "fundamental_rad_s": 0.1 * np.pi * 10 ** rng.uniform(0.3, 1.0),
        "harmonics": int(rng.integers(1, 9)),
        "ramp_s": 10 ** rng.uniform(-0.5, 0.5),
        "margin": rng.uniform(0.0, 0.5),
        "constraints": "all",
        **dict.fromkeys(
            ("position_lower_rad", "position_upper_rad", "velocity_rad_s", "acceleration_rad_s2")
        ),
    }
    return arm.model_copy(
        update={
            "limits": LimitsSection.model_validate(old.model_dump() | changed),
            "excitation": arm.excitation.model_copy(update=excitation),
        }
    )


@dataclass(frozen=True)
class Dense:
    """A period at 1 kHz: q, qd, qdd, qddd, each of shape (S, n)."""

    q: Array
    qd: Array
    qdd: Array
    qddd: Array


def dense(trajectory: Trajectory) -> Dense:
    """The period that a trajectory file describes, by complex exponentials of its numbers."""
    content = yaml.safe_load(trajectory_yaml(trajectory))
    a, b, omega = np.array(content["a"]), np.array(content["b"]), content["fundamental_rad_s"]
    speeds = (a - 1j * b).T  # a cos + b sin, the velocity, is the real part of this times e^{i w t}
    t = np.arange(0.0, 2 * np.pi / omega, 0.001)
    w = omega * np.arange(1, len(speeds) + 1)[:, None]
    turning = np.exp(1j * np.outer(t, w))
    parts = [(turning @ (speeds * (1j * w) ** power)).real for power in (-1, 0, 1, 2)]
    return Dense(parts[0] + np.array(content["q0"]), *parts[1:])


def breaches(place: DesignTask, trajectory: Trajectory) -> list[str]:
    """Limits of the design that its counted period passes at 1 kHz, by other code than its own."""
    bounds, path = place.limits, dense(trajectory)
    pairs: list[tuple[str, Array, Array | float]] = [
        ("position", path.q, np.array(bounds.position_upper_rad)),
        ("position below", -path.q, -np.array(bounds.position_lower_rad)),
        ("velocity", np.abs(path.qd), np.array(bounds.velocity_rad_s)),
        ("acceleration", np.abs(path.qdd), np.array(bounds.acceleration_rad_s2)),
        ("jerk", np.abs(path.qddd), np.array(bounds.jerk_rad_s3)),
    ]
    if place.arm.excitation.constraints == "all":
        torque, speed, distance = along(place, path)
        pairs += [
            ("torque", np.abs(torque), np.array(bounds.motor_torque_nm)),
            ("elbow speed", speed[:, 0], bounds.elbow_speed_m_s),
            ("tool speed", speed[:, 1], bounds.tool_speed_m_s),
            ("distance", -distance, -bounds.clearance_m),
        ]
    excess = {name: float(np.max(values - bound)) for name, values, bound in pairs}
    return [f"{name} by {most:.3g}" for name, most in excess.items() if most > _ROUNDING]


def along(place: DesignTask, path: Dense) -> tuple[Array, Array, Array]:
    """Motor torque (S, n), speeds of elbow and tool (S, 2), least distance (S,), by Pinocchio."""
    robot: Robot = place.robot
    model, data = robot.model, robot.model.createData()
    geometry = collision_shapes(robot).geometry
    found = pin.GeometryData(geometry)
    names = (place.limits.elbow_frame, place.limits.tool_frame)
    frames = [model.getFrameId(name) for name in names]
    rigid, speed = np.empty_like(path.q), np.empty((len(path.q), 2))
    distance = np.full(len(path.q), np.inf)
    for i, (q, qd, qdd) in enumerate(zip(path.q, path.qd, path.qdd, strict=True)):
        rigid[i] = pin.rnea(model, data, q, qd, qdd)
        pin.computeDistances(model, data, geometry, found, q)
        distance[i] = min((r.min_distance for r in found.distanceResults), default=np.inf)
        pin.computeJointJacobians(model, data, q)
        for k, frame in enumerate(frames):
            jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            speed[i, k] = np.linalg.norm(jacobian[:3] @ qd)
    viscous, coulomb = expected_friction(place.arm)
    ratios = np.array(place.arm.transmission.motor_from_joint)
    joint = rigid + viscous * path.qd + coulomb * np.sign(path.qd)
    spin = path.qdd @ ratios.T * np.array(place.arm.transmission.rotor_inertia_kg_m2)
    return np.linalg.solve(ratios.T, joint.T).T + spin, speed, distance
