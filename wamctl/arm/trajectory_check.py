"""Whether a motion keeps the arm's limits: one place for preflight, the designer and reports."""

from dataclasses import dataclass, replace

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.collision import CollisionShapes, collision_shapes, distances
from wamctl.arm.config import ArmFile, LimitsSection
from wamctl.arm.joint_labels import numbered_joints
from wamctl.arm.motion import kinetic_energy, point_speeds
from wamctl.arm.robot import Robot, inverse_dynamics
from wamctl.arm.trajectory import Reference, Trajectory, reference
from wamctl.arm.transmission import transmission

_GRID_S = 0.001


@dataclass(frozen=True)
class Quantity:
    """Something of a motion that has limits.

    Attributes:
        name: what it is, such as `velocity`.
        unit: its unit.
        subjects: what has it, m names such as `joint 4 (elbow pitch)`.
        values: shape (S, m).
        lower, upper: bounds, shape (m,); infinite where there is none.
    """

    name: str
    unit: str
    subjects: tuple[str, ...]
    values: Array
    lower: Array
    upper: Array


def check_trajectory(arm: ArmFile, robot: Robot, trajectory: Trajectory) -> list[str]:
    """What of a trajectory the arm's limits forbid, one sentence each; empty where it may run.

    One period and both ramps are sampled at 1 kHz. Torque and power are those of the robot's own
    parameters, of the rotors, and of the expected friction.

    Args:
        arm: limits, transmission, ramps and expected friction.
        robot: the arm's model.
        trajectory: the motion.
    """
    series = trajectory.series
    if series.joint_names != arm.robot.joints:
        return [
            f"the trajectory moves the joints {', '.join(series.joint_names)}, while the arm's "
            f"are {', '.join(arm.robot.joints)}"
        ]
    motion = reference(series, 1, arm.excitation.ramp_s, _GRID_S)
    measured = quantities(arm, arm.limits, robot, collision_shapes(robot), motion)
    return [sentence for quantity in measured for sentence in violations(quantity, motion.t)]


def violations(quantity: Quantity, t: Array) -> list[str]:
    """The worst breach of each subject as a sentence: who, value, bound, when.

    Args:
        quantity: values and bounds.
        t: times of the samples, shape (S,) [s].
    """
    excess = np.maximum(quantity.values - quantity.upper, quantity.lower - quantity.values)
    sentences = []
    for k in np.flatnonzero(~(excess <= 0.0).all(axis=0)):
        i = int(np.argmax(excess[:, k]))
        value = quantity.values[i, k]
        above = value > quantity.upper[k]
        bound = quantity.upper[k] if above else quantity.lower[k]
        sentences.append(
            f"{quantity.name} of {quantity.subjects[k]} is {value:.4g} {quantity.unit} at "
            f"{t[i]:.3f} s, {'above' if above else 'below'} its limit of {bound:.4g} "
            f"{quantity.unit}"
        )
    return sentences


def quantities(
    arm: ArmFile,
    limits: LimitsSection,
    robot: Robot,
    shapes: CollisionShapes,
    motion: Reference,
) -> list[Quantity]:
    """All that is limited of a motion.

    Args:
        arm: transmission and expected friction.
        limits: the bounds; the arm's own, or tighter ones.
        robot: the arm's model.
        shapes: its collision shapes.
        motion: the motion on an even grid.
    """
    joints = tuple(numbered_joints(robot.joint_names))
    motors = tuple(f"motor {k}" for k in range(1, robot.dof + 1))
    frames = (limits.elbow_frame, limits.tool_frame)
    points = (f"elbow ({limits.elbow_frame})", f"tool ({limits.tool_frame})")
    pairs = tuple(f"{a} and {b}" for a, b in shapes.pairs)
    torque, slew = motor_torque(arm, robot, motion)
    speed = motion.qd @ transmission(arm.transmission, arm.arm).motor_from_joint.T
    found = [
        ("position", "rad", joints, motion.q),
        ("velocity", "rad/s", joints, motion.qd),
        ("acceleration", "rad/s^2", joints, motion.qdd),
        ("jerk", "rad/s^3", joints, np.gradient(motion.qdd, motion.t, axis=0)),
        ("torque", "N m", motors, torque),
        ("torque slew", "N m/s", motors, slew),
        ("speed", "m/s", points, point_speeds(robot, frames, motion.q, motion.qd)),
        ("power", "W", ("all motors",), (torque * speed).sum(axis=1, keepdims=True)),
        ("kinetic energy", "J", ("the arm",), kinetic_energy(robot, motion.q, motion.qd)[:, None]),
        ("distance", "m", pairs, distances(robot, shapes, motion.q)),
    ]
    bounds = _bounds(limits, len(pairs))
    return [
        Quantity(name, unit, subjects, values, *bounds[name])
        for name, unit, subjects, values in found
        if name in bounds
    ]


def bounded(found: list[Quantity], limits: LimitsSection, part: slice) -> list[Quantity]:
    """A part of the samples, under other limits.

    Args:
        found: all that is limited of a motion.
        limits: the new bounds.
        part: the samples to keep.
    """
    bounds = _bounds(limits, found[-1].values.shape[1])
    return [
        replace(q, values=q.values[part], lower=bounds[q.name][0], upper=bounds[q.name][1])
        for q in found
    ]


def _bounds(limits: LimitsSection, pairs: int) -> dict[str, tuple[Array, Array]]:
    """Lower and upper bounds by the name of each quantity that has one."""
    symmetric = {
        "velocity": limits.velocity_rad_s,
        "acceleration": limits.acceleration_rad_s2,
        "jerk": limits.jerk_rad_s3,
        "torque": limits.motor_torque_nm,
        "torque slew": limits.motor_torque_slew_nm_s,
        "speed": (limits.elbow_speed_m_s, limits.tool_speed_m_s),
    }
    above = {"power": limits.power_w, "kinetic energy": limits.kinetic_energy_j}
    return {
        **{name: (-np.array(bound), np.array(bound)) for name, bound in symmetric.items()},
        **{
            name: (np.array([-np.inf]), np.array([bound]))
            for name, bound in above.items()
            if bound is not None
        },
        "position": (np.array(limits.position_lower_rad), np.array(limits.position_upper_rad)),
        "distance": (np.full(pairs, limits.clearance_m), np.full(pairs, np.inf)),
    }


def motor_torque(arm: ArmFile, robot: Robot, motion: Reference) -> tuple[Array, Array]:
    """Torque that a motion asks of the motors [N m] and its slew [N m/s], each of shape (S, n).

    The slew leaves Coulomb friction out: its sign is no part of the commanded torque (47).

    Args:
        arm: transmission, rotors and expected friction.
        robot: rigid-body model.
        motion: the motion on an even grid.
    """
    drive = transmission(arm.transmission, arm.arm)
    rotors = np.array(arm.transmission.rotor_inertia_kg_m2)
    viscous, coulomb = expected_friction(arm)
    smooth = inverse_dynamics(robot, motion.q, motion.qd, motion.qdd) + motion.qd * viscous
    spin = motion.qdd @ drive.motor_from_joint.T * rotors
    driven = smooth @ drive.joint_from_motor + spin
    torque = driven + (np.sign(motion.qd) * coulomb) @ drive.joint_from_motor
    return torque, np.gradient(driven, motion.t, axis=0)


def expected_friction(arm: ArmFile) -> tuple[Array, Array]:
    """Viscous [N m s/rad] and Coulomb [N m] friction to expect, each of shape (n,)."""
    none = np.zeros(len(arm.robot.joints))
    viscous = np.array(arm.excitation.expected_viscous_nm_s_rad)
    coulomb = np.array(arm.excitation.expected_coulomb_nm)
    return (viscous if len(viscous) else none), (coulomb if len(coulomb) else none)
