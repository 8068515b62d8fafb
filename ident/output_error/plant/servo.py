"""Position servos in compiled form: commands in, torques out."""

from typing import NamedTuple

import numpy as np

from ident.dynamics.compiled_chain import inverse_dynamics, workspace
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
    LOAD_SIDE, GRAVITY_GAIN, INTEGRAL_LIMIT,
) = range(32)  # fmt: skip
"""Rows of a settings array, in the order of `QUANTITIES`."""

_BEFORE_S = 10.0
"""How long a servo has been on where a recording begins [s]."""

_LOOKS = 4
"""Parts of a span in each of which a command may change."""

_SLOW = 0.02
"""Speed below which friction may push either way [rad/s]."""


GOAL, PACE, FED, INTEGRATED = range(4)
"""Rows of what servos hold from step to step: where one that plans its motion wants to be now
[rad], the speed of that [rad/s], and the torques against the links' weight and of the integrated
error [N m]."""

STEPS, SPANS = range(2)
"""Rows of the last command that acts, in steps and in spans of a simulation."""


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
def commanded(motion, at, row, i, t, h):
    """Mean command over the step that begins at t, and its rate between samples."""
    stamp, last = motion.stamp, motion.stamp.size - 1
    while at[row, i] < last and stamp[at[row, i] + 1] <= t:
        at[row, i] += 1
    k = at[row, i]
    now, before = motion.command[k, i], motion.command[max(k - 1, 0), i]
    if k < last and t + h > stamp[k + 1]:
        part = min((t + h - stamp[k + 1]) / h, 1.0)
        after, span = motion.command[k + 1, i], stamp[k + 1] - stamp[k]
        rate = ((now - before) * (1.0 - part) + (after - now) * part) / span
        return now + part * (after - now), rate
    return now, (now - before) / (stamp[k] - stamp[k - 1]) if k > 0 else 0.0


@compiled
def planned(p, i, wanted, held, h):
    """Place and speed of the motion that the servo plans to what is wanted."""
    place = held[GOAL, i]
    far, hard = wanted - place, p[PROFILE_ACCELERATION, i]
    short = 0.5 * hard * h
    stopping = np.sqrt(short * short + 2.0 * hard * abs(far)) - short
    fast = min(p[PROFILE_SPEED, i], stopping, abs(far) / h)
    change = (fast if far > 0.0 else -fast) - held[PACE, i]
    held[PACE, i] += min(max(change, -hard * h), hard * h)
    held[GOAL, i] += h * held[PACE, i]
    return place, held[PACE, i]


@compiled
def begun(p, motion, step):
    """The last commands that act, and what servos hold, where a recording begins."""
    n = motion.start.size
    at, held = np.zeros((2, n), dtype=np.int64), np.zeros((4, n))
    for i in range(n):
        held[GOAL, i], _ = commanded(motion, at, STEPS, i, motion.t[0] - p[DELAY, i], step)
        held[PACE, i] = motion.speed[i]
    return at, held


@compiled
def fed_forward(chain, delta, p, motion, at, held, t, span):
    """What servos feed forward against the weight of the links where these should be.

    That of the middle of what is commanded, or planned, over a span.
    """
    n = motion.start.size
    if not np.any(p[GRAVITY_GAIN] != 0.0):
        return
    aim, still, part = p[ZERO].copy(), np.zeros(n), span / _LOOKS
    for i in range(n):
        if p[PROFILE_ACCELERATION, i] < NO_PROFILE:
            aim[i] += held[GOAL, i] + 0.5 * span * held[PACE, i]
        else:
            for k in range(_LOOKS):
                then = t + k * part - p[DELAY, i]
                aim[i] += commanded(motion, at, SPANS, i, then, part)[0] / _LOOKS
    inverse_dynamics(chain, delta, aim, still, still, workspace(n), held[FED])
    for i in range(n):
        held[FED, i] *= p[GRAVITY_GAIN, i]


@compiled
def servo(p, i, error, rate, fed, integral, h):
    """Torque at the joint that a servo gives over a step [N m], with what is fed forward."""
    dead = p[DEAD_ZONE, i]
    felt = error - min(max(error, -dead), dead)
    integral[i] += h * p[INTEGRAL, i] * felt
    integral[i] = min(max(integral[i], -p[INTEGRAL_LIMIT, i]), p[INTEGRAL_LIMIT, i])
    wanted = p[STIFFNESS, i] * felt + integral[i] + p[RATE_GAIN, i] * rate + fed
    given = min(max(wanted, -p[TORQUE_LIMIT, i]), p[TORQUE_LIMIT, i])
    integral[i] -= wanted - given if p[INTEGRAL, i] > 0.0 else 0.0
    return given


@compiled
def gathered(p, motion, held, bias):
    """What the servos' integrals hold where a recording begins [N m]: they carry the load.

    Those of servos which have held or moved their arm for some seconds, so that a weak one holds a
    part of it. `bias` is the load of the links at rest [N m], shape (n,).
    """
    for i in range(bias.size):
        if p[INTEGRAL, i] > 0.0:
            error, speed = held[GOAL, i] - motion.start[i], motion.speed[i]
            felt = error - min(max(error, -p[DEAD_ZONE, i]), p[DEAD_ZONE, i])
            friction = p[DAMPING, i] * speed + p[COULOMB, i] * speed / (abs(speed) + _SLOW)
            spring = p[SPRING, i] * (motion.start[i] + p[ZERO, i])
            carried = bias[i] - held[FED, i] + spring + p[OFFSET, i] + friction
            carried -= p[STIFFNESS, i] * felt
            share = 1.0 - np.exp(-_BEFORE_S * p[INTEGRAL, i] / p[STIFFNESS, i])
            most = min(p[TORQUE_LIMIT, i], p[INTEGRAL_LIMIT, i])
            held[INTEGRATED, i] = share * min(max(carried, -most), most)


@compiled
def motor_command(chain, delta, motion, settings, step):
    """What the servos' position loops get: commands after delay and planning.

    Returns:
        instants [s], shape (K,), and positions [rad], shape (K, n), with what the servos give for
        the planned speed and for the links' weight as a further error.
    """
    n, p = motion.start.size, settings
    count = int(np.ceil((motion.t[-1] - motion.t[0]) / step))
    grid, made = np.empty(count), np.empty((count, n))
    at, held = begun(p, motion, step)
    for k in range(count):
        grid[k] = motion.t[0] + k * step
        fed_forward(chain, delta, p, motion, at, held, grid[k], step)
        for i in range(n):
            then = grid[k] - p[DELAY, i]
            wanted, rate = commanded(motion, at, STEPS, i, then, step)
            if p[PROFILE_ACCELERATION, i] < NO_PROFILE:
                wanted, rate = planned(p, i, wanted, held, step)
            forward = p[RATE_GAIN, i] * rate + held[FED, i]
            made[k, i] = wanted + forward / p[STIFFNESS, i]
    return grid, made
