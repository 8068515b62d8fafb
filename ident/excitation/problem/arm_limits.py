"""The limits that a design keeps, and whether any motion can keep them."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ident.signals.arrays import Array
from wamctl.arm.collision import CollisionShapes, collision_shapes
from wamctl.arm.config import ArmFile, LimitsSection
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory import Reference
from wamctl.arm.trajectory_check import Quantity, quantities, violations
from wamctl.arm.transmission import transmission

JOINT_MOTION = frozenset({"position", "velocity", "acceleration", "jerk"})
"""Names of the quantities whose limits `joint_motion` keeps."""

_POSES = 400
_CREEP_RAD_S = 1e-9
"""Slow enough to be at rest, but with friction against it."""


def design_limits(arm: ArmFile, source: Path | str) -> LimitsSection:
    """The arm's limits less the margin, or what the excitation section asks for where tighter.

    Raises:
        ConfigurationError: a joint without any range; the sentence names it.
    """
    limits, wanted = arm.limits, arm.excitation
    left = 1.0 - wanted.margin
    lower, upper = np.array(limits.position_lower_rad), np.array(limits.position_upper_rad)
    middle, half = (lower + upper) / 2, left * (upper - lower) / 2
    lower = np.maximum(middle - half, wanted.position_lower_rad or -np.inf)
    upper = np.minimum(middle + half, wanted.position_upper_rad or np.inf)
    faults = [
        f"excitation: the position range of joint {k} is empty, {low:g} to {high:g} rad, once the "
        "tighter of the excitation's and the arm's limits is taken"
        for k, (low, high) in enumerate(zip(lower, upper, strict=True), 1)
        if low >= high
    ]
    if faults:
        raise ConfigurationError(source, faults)
    slow = wanted.speed_m_s or np.inf
    tightened = {
        "position_lower_rad": tuple(lower.tolist()),
        "position_upper_rad": tuple(upper.tolist()),
        "velocity_rad_s": _least(limits.velocity_rad_s, left, wanted.velocity_rad_s),
        "acceleration_rad_s2": _least(limits.acceleration_rad_s2, left, wanted.acceleration_rad_s2),
        "jerk_rad_s3": _least(limits.jerk_rad_s3, left, None),
        "motor_torque_nm": _least(limits.motor_torque_nm, left, None),
        "motor_torque_slew_nm_s": _least(limits.motor_torque_slew_nm_s, left, None),
        "elbow_speed_m_s": min(limits.elbow_speed_m_s * left, slow),
        "tool_speed_m_s": min(limits.tool_speed_m_s * left, slow),
        "clearance_m": limits.clearance_m / left,
    }
    return limits.model_copy(update=tightened)


def _least(
    bound: tuple[float, ...], left: float, wanted: tuple[float, ...] | None
) -> tuple[float, ...]:
    return tuple(np.minimum(np.array(bound) * left, wanted or np.inf).tolist())


def kept_of(arm: ArmFile, found: Sequence[Quantity]) -> list[Quantity]:
    """Of all that is limited, what a design for this arm must keep."""
    everything = arm.excitation.constraints == "all"
    return [quantity for quantity in found if everything or quantity.name in JOINT_MOTION]


def possible_pose(arm: ArmFile, robot: Robot, limits: LimitsSection, source: Path | str) -> Array:
    """A pose in which the arm may start to move, shape (n,): the middle one, or a random one.

    Args:
        arm: transmission, friction, and which limits count.
        robot: the arm's model.
        limits: the design's bounds.
        source: what to call the configuration in messages.

    Raises:
        ConfigurationError: there is none; the sentences say what stands against the best one.
    """
    shapes = collision_shapes(robot)
    fewest: list[str] | None = None
    for pose in some_poses(limits):
        faults = faults_at(arm, robot, limits, shapes, pose)
        if not faults:
            return pose
        if fewest is None or len(faults) < len(fewest):
            fewest = faults
    raise ConfigurationError(
        source,
        [
            f"no pose was found from which the arm may move; in the best of {_POSES}, "
            + "; ".join(fewest or [])
        ],
    )


def some_poses(limits: LimitsSection) -> Array:
    """The middle of the position range, and random poses of it, shape (P, n)."""
    lower, upper = np.array(limits.position_lower_rad), np.array(limits.position_upper_rad)
    rng = np.random.default_rng(0)
    return np.vstack([(lower + upper) / 2, rng.uniform(lower, upper, (_POSES - 1, len(lower)))])


def faults_at(
    arm: ArmFile, robot: Robot, limits: LimitsSection, shapes: CollisionShapes, pose: Array
) -> list[str]:
    """What forbids to start moving from a pose, shape (n,).

    Friction is tried in the directions that ask most of each motor: behind a differential these are
    neither all joints forwards nor all backwards.
    """
    drive = transmission(arm.transmission, arm.arm)
    hardest = np.where(drive.joint_from_motor.T < 0, -_CREEP_RAD_S, _CREEP_RAD_S)
    creep = np.vstack([hardest, -hardest])
    t, still = np.arange(float(len(creep))), np.zeros_like(creep)
    motion = Reference(t, np.tile(pose, (len(t), 1)), creep, still, slice(0, len(t)))
    measured = quantities(arm, limits, robot, shapes, motion)
    sentences = [s for q in kept_of(arm, measured) for s in violations(q, t)]
    return [re.sub(r" at [0-9.]+ s,", ",", s) for s in sentences]
