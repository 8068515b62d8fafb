"""Position servos in compiled form: commands in, torques out."""

from typing import NamedTuple

import numpy as np

from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

NO_PROFILE = 1e5
"""A servo that plans no motion has a larger acceleration [rad/s^2]."""

(
    STIFFNESS, INTEGRAL, RATE_GAIN, DEAD_ZONE, TORQUE_LIMIT, PROFILE_SPEED,
    PROFILE_ACCELERATION, DELAY, ARMATURE, DAMPING,
    COULOMB, STRIBECK, STRIBECK_SPEED, STRIBECK_EXPONENT, LOAD_FRICTION, OFFSET, HALF_PLAY,
    COMPLIANCE, ZERO, SPRING, DRAG, SKEW, TURNING_SPEED, PRESLIDING, RISE_SPEED,
    GEAR_LAG, LINK_FRICTION, SPEED_GAIN, LINK_ARMATURE,
    LOAD_SIDE,
) = range(30)  # fmt: skip
"""Rows of a settings array, in the order of `QUANTITIES`."""

_BEFORE_S = 10.0
"""How long a servo has been on where a recording begins [s]."""

_SLOW = 0.02
"""Speed below which friction may push either way [rad/s]."""


class Motion(NamedTuple):
    """Commands and when they came.

    Attributes:
        t: instants at which positions are told [s], shape (S,), rising.
        stamp: instants of the commands [s], shape (C,), rising.
        command: position that is wanted from each of them on [rad], shape (C, n).
        start: position at the first instant [rad], shape (n,).
        speed: likewise [rad/s].
    """

    t: Array
    stamp: Array
    command: Array
    start: Array
    speed: Array


@compiled
def commanded(motion, at, i, t, h):
    """Mean command over the step that begins at t, and its rate between samples."""
    stamp, last = motion.stamp, motion.stamp.size - 1
    while at[i] < last and stamp[at[i] + 1] <= t:
        at[i] += 1
    k = at[i]
    now, before = motion.command[k, i], motion.command[max(k - 1, 0), i]
    if k < last and t + h > stamp[k + 1]:
        part = min((t + h - stamp[k + 1]) / h, 1.0)
        after, span = motion.command[k + 1, i], stamp[k + 1] - stamp[k]
        rate = ((now - before) * (1.0 - part) + (after - now) * part) / span
        return now + part * (after - now), rate
    return now, (now - before) / (stamp[k] - stamp[k - 1]) if k > 0 else 0.0


@compiled
def planned(p, i, wanted, goal, pace, h):
    """Speed of the motion that the servo plans to what is wanted; its place is in `goal`."""
    far, hard = wanted - goal[i], p[PROFILE_ACCELERATION, i]
    short = 0.5 * hard * h
    stopping = np.sqrt(short * short + 2.0 * hard * abs(far)) - short
    fast = min(p[PROFILE_SPEED, i], stopping, abs(far) / h)
    change = (fast if far > 0.0 else -fast) - pace[i]
    pace[i] += min(max(change, -hard * h), hard * h)
    goal[i] += h * pace[i]
    return pace[i]


@compiled
def servo(p, i, error, rate, integral, h):
    """Torque at the joint that the servo gives [N m]."""
    dead = p[DEAD_ZONE, i]
    felt = error - min(max(error, -dead), dead)
    integral[i] += h * p[INTEGRAL, i] * felt
    wanted = p[STIFFNESS, i] * felt + integral[i] + p[RATE_GAIN, i] * rate
    given = min(max(wanted, -p[TORQUE_LIMIT, i]), p[TORQUE_LIMIT, i])
    integral[i] -= wanted - given if p[INTEGRAL, i] > 0.0 else 0.0
    return given


@compiled
def gathered(p, motion, goal, bias, integral):
    """What the servos' integrals hold where a recording begins [N m]: they carry the load.

    Those of servos which have held or moved their arm for some seconds, so that a weak one holds a
    part of it. `bias` is the load of the links at rest [N m], shape (n,).
    """
    for i in range(integral.size):
        if p[INTEGRAL, i] > 0.0:
            error, speed = goal[i] - motion.start[i], motion.speed[i]
            felt = error - min(max(error, -p[DEAD_ZONE, i]), p[DEAD_ZONE, i])
            friction = p[DAMPING, i] * speed + p[COULOMB, i] * speed / (abs(speed) + _SLOW)
            spring = p[SPRING, i] * (motion.start[i] + p[ZERO, i])
            held = bias[i] + spring + p[OFFSET, i] + friction - p[STIFFNESS, i] * felt
            share = 1.0 - np.exp(-_BEFORE_S * p[INTEGRAL, i] / p[STIFFNESS, i])
            integral[i] = share * min(max(held, -p[TORQUE_LIMIT, i]), p[TORQUE_LIMIT, i])


@compiled
def motor_command(motion, settings, step):
    """What the servos' position loops get: commands after delay and planning.

    Returns:
        instants [s], shape (K,), and positions [rad], shape (K, n), with the planned speed's part
        of the torque as a further error.
    """
    n, p = motion.start.size, settings
    count = int(np.ceil((motion.t[-1] - motion.t[0]) / step))
    grid, made = np.empty(count), np.empty((count, n))
    at, goal, pace = np.zeros(n, dtype=np.int64), np.empty(n), motion.speed.copy()
    for i in range(n):
        goal[i], _ = commanded(motion, at, i, motion.t[0] - p[DELAY, i], step)
    for k in range(count):
        grid[k] = motion.t[0] + k * step
        for i in range(n):
            wanted, rate = commanded(motion, at, i, grid[k] - p[DELAY, i], step)
            if p[PROFILE_ACCELERATION, i] < NO_PROFILE:
                rate = planned(p, i, wanted, goal, pace, step)
                wanted = goal[i]
            made[k, i] = wanted + p[RATE_GAIN, i] * rate / p[STIFFNESS, i]
    return grid, made
