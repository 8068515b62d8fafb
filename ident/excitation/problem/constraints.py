"""The arm's limits on a grid as numbers of at most 1, with gradients."""

from dataclasses import dataclass, replace

import numpy as np

from ident.dynamics.compiled_chain import Chain, chain_of
from ident.dynamics.regressor import Motion
from ident.excitation.problem import clearance as geometry
from ident.excitation.problem.clearance import Points, Shapes, points_of, shapes_of
from ident.excitation.problem.regressor_columns import Columns
from ident.signals.arrays import Array
from wamctl.arm.collision import collision_shapes
from wamctl.arm.config import ArmFile, LimitsSection
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory_check import expected_friction
from wamctl.arm.transmission import transmission

_SIGHT_M = 0.1
"""Shapes further apart than this beyond the clearance do not matter."""


@dataclass(frozen=True)
class Bounds:
    """What scales each quantity to 1.

    Attributes:
        middle: of the position range, shape (n,) [rad].
        kinematic: half range, velocity, acceleration and jerk, shape (4, n).
        torque: per motor, shape (n,) [N m].
        speed: of elbow and tool, shape (2,) [m/s]; empty where it does not count.
        clearance: least distance of shapes [m].
    """

    middle: Array
    kinematic: Array
    torque: Array
    speed: Array
    clearance: float


@dataclass(frozen=True)
class Constraints:
    """The arm and its bounds.

    Attributes:
        bounds: what scales each quantity.
        chain, points, shapes: kinematics, the points whose speed is limited, and what may collide.
        joint_from_motor: transmission, shape (n, n).
        rotor: motor torque per joint acceleration, shape (n, n), as rows times this.
        viscous, coulomb: expected friction, shape (n,).
    """

    bounds: Bounds
    chain: Chain
    points: Points
    shapes: Shapes
    joint_from_motor: Array
    rotor: Array
    viscous: Array
    coulomb: Array


@dataclass(frozen=True)
class Adjoints:
    """Gradients that grow as each part of the problem adds its own.

    Attributes:
        q, qd, qdd, qddd: shape (S, n).
        rows: by the smooth rows of W, shape (n, S, b).
    """

    q: Array
    qd: Array
    qdd: Array
    qddd: Array
    rows: Array


def bounds_of(limits: LimitsSection) -> Bounds:
    """The bounds of an arm, or of a design."""
    lower, upper = np.array(limits.position_lower_rad), np.array(limits.position_upper_rad)
    rates = [limits.velocity_rad_s, limits.acceleration_rad_s2, limits.jerk_rad_s3]
    return Bounds(
        (lower + upper) / 2,
        np.array([(upper - lower) / 2, *rates]),
        np.array(limits.motor_torque_nm),
        np.array([limits.elbow_speed_m_s, limits.tool_speed_m_s]),
        limits.clearance_m,
    )


def constraints_of(arm: ArmFile, robot: Robot, limits: LimitsSection) -> Constraints:
    """The constraints of a design.

    Args:
        arm: transmission, rotors, expected friction, and which limits count.
        robot: the arm's model, with its collision shapes.
        limits: the bounds.
    """
    drive = transmission(arm.transmission, arm.arm)
    viscous, coulomb = expected_friction(arm)
    bounds, shapes = bounds_of(limits), shapes_of(collision_shapes(robot))
    points = points_of(robot, (limits.elbow_frame, limits.tool_frame))
    if arm.excitation.constraints == "joint_motion":
        boundless = np.full_like(bounds.torque, np.inf)
        bounds = replace(bounds, torque=boundless, speed=bounds.speed[:0])
        points = Points(points.link[:0], points.position[:0])
        shapes = shapes._replace(pairs=shapes.pairs[:0])
    return Constraints(
        bounds,
        chain_of(robot),
        points,
        shapes,
        drive.joint_from_motor,
        drive.motor_from_joint.T * np.array(arm.transmission.rotor_inertia_kg_m2),
        viscous,
        coulomb,
    )


def lower_bounds(constraints: Constraints, samples: int) -> Array:
    """Lower bound of each entry of `values`; the upper ones are 1."""
    n = len(constraints.bounds.middle)
    two_sided, one_sided = (
        5 * samples * n,
        samples * (len(constraints.bounds.speed) + len(constraints.shapes.pairs)),
    )
    return np.concatenate([np.full(two_sided, -1.0), np.full(one_sided, -np.inf)])


def values(
    constraints: Constraints,
    columns: Columns,
    motion: Motion,
    jerk: Array,
    rows: Array,
    softness_rad_s: float,
) -> Array:
    """All limited quantities in units of their bounds, one after another, shape (M,).

    Args:
        constraints: the arm and its bounds.
        columns: what the rows hold.
        motion: S samples of n joints.
        jerk: shape (S, n) [rad/s^3].
        rows: smooth rows of W, shape (n, S, b).
        softness_rad_s: width of the smoothed sign [rad/s].
    """
    c, samples = constraints, len(motion.q)
    kinematic = np.array([motion.q - c.bounds.middle, motion.qd, motion.qdd, jerk])
    rigid = (rows[:, :, : columns.links] @ columns.cad).T
    slip = np.tanh(motion.qd / softness_rad_s)
    joint = rigid + motion.qd * c.viscous + slip * c.coulomb
    torque = (joint @ c.joint_from_motor + motion.qdd @ c.rotor) / c.bounds.torque
    squares = np.empty((samples, len(c.bounds.speed)))
    geometry.point_speeds(c.chain, c.points, motion.q, motion.qd, squares)
    apart = np.empty((samples, len(c.shapes.pairs)))
    geometry.distances(c.chain, c.shapes, motion.q, c.bounds.clearance + _SIGHT_M, apart)
    nearness = 1.0 + (c.bounds.clearance - apart) / _SIGHT_M
    scaled = kinematic / c.bounds.kinematic[:, None, :]
    parts = (scaled, torque, squares / c.bounds.speed**2, nearness)
    return np.concatenate([part.ravel() for part in parts])


def constraints_vjp(
    constraints: Constraints,
    columns: Columns,
    motion: Motion,
    bar: Array,
    softness_rad_s: float,
    adjoints: Adjoints,
) -> None:
    """Add the gradient of sum(bar * values) to the adjoints.

    Args:
        constraints: the arm and its bounds.
        columns: what the rows hold.
        motion: S samples of n joints.
        bar: shape (M,).
        softness_rad_s: width of the smoothed sign [rad/s].
        adjoints: what grows.
    """
    c, (samples, n) = constraints, motion.q.shape
    counts = np.cumsum([4 * samples * n, samples * n, samples * len(c.bounds.speed)])
    kinematic, torque, squares, nearness = np.split(bar, counts)
    scaled = kinematic.reshape(4, samples, n) / c.bounds.kinematic[:, None, :]
    for slope, part in zip(
        (adjoints.q, adjoints.qd, adjoints.qdd, adjoints.qddd), scaled, strict=True
    ):
        slope += part
    motor = torque.reshape(samples, n) / c.bounds.torque
    joint = motor @ c.joint_from_motor.T
    adjoints.rows[:, :, : columns.links] += joint.T[:, :, None] * columns.cad
    slip = np.tanh(motion.qd / softness_rad_s)
    adjoints.qd[:] += joint * (c.viscous + c.coulomb * (1.0 - slip**2) / softness_rad_s)
    adjoints.qdd[:] += motor @ c.rotor.T
    bar_squares = squares.reshape(samples, -1) / c.bounds.speed**2
    geometry.speeds_vjp(
        c.chain, c.points, motion.q, motion.qd, bar_squares, adjoints.q, adjoints.qd
    )
    bar_apart = nearness.reshape(samples, -1) / -_SIGHT_M
    geometry.distances_vjp(c.chain, c.shapes, motion.q, bar_apart, adjoints.q)
