"""Moves from rest to rest, and how fast points of the arm go along a motion."""

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.config import LimitsSection
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory import Reference

_SHARE = 0.5  # of every limit: a move is no part of the measurement and need not hurry
_PEAKS = (15.0 / 8.0, 10.0 / np.sqrt(3.0), 60.0)
"""Largest velocity, acceleration and jerk of the polynomial for a way of 1 in a time of 1."""


def move(
    robot: Robot, limits: LimitsSection, start: Array, goal: Array, period_s: float
) -> Reference:
    """The straight way between two poses at half of the arm's limits, elbow and tool included.

    The polynomial of fifth order that begins and ends at rest.

    Args:
        robot: kinematics, for the speed of elbow and tool.
        limits: what the arm may do.
        start: pose at the beginning, shape (n,) [rad].
        goal: pose at the end, shape (n,) [rad].
        period_s: cycle time [s].
    """
    way = goal - start
    most = (limits.velocity_rad_s, limits.acceleration_rad_s2, limits.jerk_rad_s3)
    needed = [
        float(np.max(peak * np.abs(way) / (_SHARE * np.array(limit)))) ** (1.0 / order)
        for order, (peak, limit) in enumerate(zip(_PEAKS, most, strict=True), 1)
    ]
    seconds = max(period_s, *needed)
    q, qd, _ = _quintic(start, way, np.linspace(0.0, 1.0, 200), seconds)
    allowed = _SHARE * np.array([limits.elbow_speed_m_s, limits.tool_speed_m_s])
    points = point_speeds(robot, (limits.elbow_frame, limits.tool_frame), q, qd).max(axis=0)
    seconds *= max(1.0, float(np.max(points / allowed)))
    t = np.arange(int(np.ceil(seconds / period_s)) + 1) * period_s
    return Reference(t, *_quintic(start, way, np.minimum(t / seconds, 1.0), seconds), slice(0, 0))


def _quintic(start: Array, way: Array, share: Array, seconds: float) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration at shares of the time, shapes (S, n)."""
    s = share[:, None]
    path = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    speed = 30.0 * (s * (1.0 - s)) ** 2 / seconds
    acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / seconds**2
    return start + path * way, speed * way, acceleration * way


def brake(q: Array, qd: Array, braking_s: float, period_s: float) -> Reference:
    """Constant deceleration from the measured state to rest, all joints at the same time.

    Args:
        q: position at the start [rad], shape (n,).
        qd: velocity at the start [rad/s], shape (n,).
        braking_s: time to rest [s].
        period_s: cycle time [s].
    """
    t = np.arange(1, max(1, round(braking_s / period_s)) + 1)[:, None] * period_s
    left = np.maximum(0.0, 1.0 - t / braking_s)
    path = q + qd * braking_s / 2 * (1.0 - left**2)
    return Reference(t[:, 0], path, qd * left, np.tile(-qd / braking_s, (len(t), 1)), slice(0, 0))


def point_speeds(robot: Robot, frames: tuple[str, ...], q: Array, qd: Array) -> Array:
    """Speed of the origins of URDF frames along a motion, shape (S, len(frames)) [m/s].

    Args:
        robot: kinematics.
        frames: names of URDF links.
        q: position [rad], shape (S, n).
        qd: velocity [rad/s], shape (S, n).
    """
    data = robot.data()
    ids = [robot.model.getFrameId(name) for name in frames]
    speeds = np.empty((len(q), len(ids)))
    for i, (position, velocity) in enumerate(zip(q, qd, strict=True)):
        pin.forwardKinematics(robot.model, data, position, velocity)
        speeds[i] = [np.linalg.norm(pin.getFrameVelocity(robot.model, data, k).linear) for k in ids]
    return speeds


def kinetic_energy(robot: Robot, q: Array, qd: Array) -> Array:
    """Of the whole arm along a motion, shape (S,) [J].

    Args:
        robot: rigid-body model.
        q: position [rad], shape (S, n).
        qd: velocity [rad/s], shape (S, n).
    """
    data = robot.data()
    states = zip(q, qd, strict=True)
    return np.array([pin.computeKineticEnergy(robot.model, data, *state) for state in states])
