"""Jerk-limited moves from rest to rest, and how fast points of the arm go along a motion."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from ruckig import InputParameter, Result, Ruckig
from ruckig import Trajectory as Profile

from wamctl.arm.config import LimitsSection
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory import Reference

Array = NDArray[np.floating]

_SHARE = 0.5  # of every limit: a move is no part of the measurement and need not hurry


def move(
    robot: Robot, limits: LimitsSection, start: Array, goal: Array, period_s: float
) -> Reference:
    """The motion between two poses at half of the arm's limits, elbow and tool speed included.

    Args:
        robot: kinematics, for the speed of elbow and tool.
        limits: what the arm may do.
        start: pose at the beginning, shape (n,) [rad].
        goal: pose at the end, shape (n,) [rad].
        period_s: cycle time [s].
    """
    profile = _profile(limits, start, goal)
    fine = np.linspace(0.0, profile.duration, 200)
    q, qd, _ = _sample(profile, fine, len(start))
    allowed = _SHARE * np.array([limits.elbow_speed_m_s, limits.tool_speed_m_s])
    peak = point_speeds(robot, (limits.elbow_frame, limits.tool_frame), q, qd).max(axis=0)
    pace = float(min(1.0, np.min(allowed / np.maximum(peak, 1e-9))))
    t = np.arange(int(np.ceil(profile.duration / pace / period_s)) + 1) * period_s
    q, qd, qdd = _sample(profile, np.minimum(t * pace, profile.duration), len(start))
    return Reference(t, q, qd * pace, qdd * pace**2, slice(0, 0))


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


def _profile(limits: LimitsSection, start: Array, goal: Array) -> Profile:
    n = len(start)
    wanted = InputParameter(n)
    wanted.current_position, wanted.target_position = start.tolist(), goal.tolist()
    wanted.max_velocity = [_SHARE * v for v in limits.velocity_rad_s]
    wanted.max_acceleration = [_SHARE * a for a in limits.acceleration_rad_s2]
    wanted.max_jerk = [_SHARE * j for j in limits.jerk_rad_s3]
    profile = Profile(n)
    outcome = Ruckig(n).calculate(wanted, profile)
    if outcome not in (Result.Working, Result.Finished):
        raise ValueError(f"no move from {start} to {goal} ({outcome})")
    return profile


def _sample(profile: Profile, t: Array, n: int) -> tuple[Array, Array, Array]:
    states = np.array([profile.at_time(float(s)) for s in t]).reshape(len(t), 3, n)
    return states[:, 0], states[:, 1], states[:, 2]
