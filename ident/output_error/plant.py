"""Position servos, gears, and links in compiled form: commands in, positions out.

Links are one coupled rigid-body system; their mass matrix and the torque of gravity and speed are
formed for the middle of one sample, and held while servo, friction, and play take these. Speeds
stand half a step before positions, a step's torque is that of its middle, and damping takes over a
step what it would take in continuous time: a step that is too coarse would pass for inertia and
delay. A joint without play or twist moves as one with its rotor; one with them pushes through a
dead zone with a spring, without rebound. Friction rubs at the rotor, through bristles in series
with a damper; their bend is remembered. All joints' impulses of a step are found by Gauss-Seidel
sweeps, each joint's own exactly.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from ident.dynamics.compiled_chain import inverse_dynamics, invert, mass_matrix, workspace
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

_SWEEPS = 40
_HELD_S = 0.025  # for which mass and gravity are held at most: some microradians on a hobby arm
_NO_PROFILE = 1e5  # rad/s^2
_CREEP = 1e-6  # rad/s: slower than anything that is seen
_SETTLED = 1e-4  # of the largest impulse of a step: less than a thousandth of a 12-bit step

(
    STIFFNESS, INTEGRAL, RATE_GAIN, DEAD_ZONE, TORQUE_LIMIT, PROFILE_SPEED,
    PROFILE_ACCELERATION, DELAY, ARMATURE, DAMPING,
    COULOMB, STRIBECK, STRIBECK_SPEED, STRIBECK_EXPONENT, LOAD_FRICTION, OFFSET, HALF_PLAY,
    COMPLIANCE, ZERO, SPRING, DRAG, SKEW, TURNING_SPEED, PRESLIDING, RISE_SPEED, GEAR_LAG,
) = range(26)  # fmt: skip


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


Joints = namedtuple("Joints", "loose q rotor speed torque free level share turning bent")
"""What a step knows of the joints, shape (n,) each, written in place: whether play or twist is
between link and rotor; their positions [rad] and the rotor's speed [rad/s]; the motor's torque
[N m]; the link's speed without the impulses; the largest impulse of friction [N m s]; and, as
`damped` and `bend` have them, damping and bristles."""


@compiled(nogil=True)
def simulate(chain, delta, settings, at_link, motion, step, out):
    """Positions that the encoders tell at each instant.

    Args:
        chain: kinematics and gravity.
        delta: the links' parameters, shape (10 n,).
        settings: rows as `QUANTITIES` has them, shape (quantities, n).
        at_link: whether each joint's encoder sits behind the gears, shape (n,).
        motion: what is commanded.
        step: longest step [s].
        out: positions [rad], shape (S, n).
    """
    samples, n = motion.t.size, motion.start.size
    p = settings
    w = workspace(n)
    bias, still, mass = np.zeros(n), np.zeros(n), np.zeros((n, n))
    a, inverse = np.zeros((n, n)), np.zeros((n, n))
    q, v, rotor, speed = np.empty(n), motion.speed.copy(), np.empty(n), motion.speed.copy()
    impulse, free, momentum, integral = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    torque, level, middle = np.zeros(n), np.zeros(n), np.zeros(n)
    share, bent, turning = np.zeros(n), np.zeros(n), np.zeros(n)
    loose = np.empty(n, dtype=np.bool_)
    at = np.zeros(n, dtype=np.int64)
    goal, pace = np.empty(n), motion.speed.copy()
    for i in range(n):
        loose[i] = p[HALF_PLAY, i] > 0.0 or p[COMPLIANCE, i] > 0.0
        q[i] = motion.start[i] + p[ZERO, i]
        rotor[i] = q[i]
        out[0, i] = motion.start[i]
        goal[i], _ = commanded(motion, at, i, motion.t[0] - p[DELAY, i], step)
    joints = Joints(loose, q, rotor, speed, torque, free, level, share, turning, bent)
    inverse_dynamics(chain, delta, q, still, still, w, bias)
    twisted(p, at_link, loose, bias, q, rotor)
    for k in range(samples - 1):
        whole = motion.t[k + 1] - motion.t[k]
        parts = max(1, int(np.ceil(whole / _HELD_S - 1e-6)))
        span = whole / parts
        for part in range(parts):
            steps = max(1, int(np.ceil(span / step - 1e-6)))
            h = span / steps
            for i in range(n):
                middle[i] = q[i] + 0.5 * span * v[i]
            inverse_dynamics(chain, delta, middle, v, still, w, bias)
            mass_matrix(chain, delta, w, mass)
            damped(p, loose, mass, a, share, turning, h)
            invert(a, inverse)
            for s in range(steps):
                t = motion.t[k] + part * span + s * h
                for i in range(n):
                    here = (q[i] if at_link[i] else rotor[i]) - p[ZERO, i]
                    wanted, rate = commanded(motion, at, i, t - 0.5 * h - p[DELAY, i], h)
                    if p[PROFILE_ACCELERATION, i] < _NO_PROFILE:
                        aim = goal[i]
                        rate = planned(p, i, wanted, goal, pace, h)
                        wanted = aim
                    torque[i] = servo(p, i, wanted - here, rate, integral, h) - p[OFFSET, i]
                    torque[i] -= speed_torque(p, i, speed[i], share[i])
                    level[i] = h * dry_friction(p, i, speed[i], bias[i])
                    momentum[i] = -h * (bias[i] + p[SPRING, i] * q[i])
                    for j in range(n):
                        momentum[i] += mass[i, j] * v[j]
                    if not loose[i]:
                        momentum[i] += h * torque[i]
                product(inverse, momentum, free)
                solve(p, joints, inverse, impulse, h)
                product(inverse, impulse, v)
                for i in range(n):
                    v[i] += free[i]
                    q[i] += h * v[i]
                    if loose[i]:
                        left = p[ARMATURE, i] * speed[i] + h * torque[i] - impulse[i]
                        inertia = p[ARMATURE, i] + h * share[i] * p[DAMPING, i]
                        left += inertia * bent[i]
                        speed[i] = slowed(left, level[i], turning[i], inertia) - bent[i]
                        rotor[i] += h * speed[i]
                    else:
                        speed[i], rotor[i] = v[i], q[i]
                    bent[i] = bend(p, i, speed[i] + bent[i], turning[i]) / h
        for i in range(n):
            out[k + 1, i] = (q[i] if at_link[i] else rotor[i]) - p[ZERO, i]


@compiled
def twisted(p, at_link, loose, bias, q, rotor):
    """Rotors and links of loose joints as gravity holds them."""
    for i in range(q.size):
        if loose[i]:
            beyond = p[COMPLIANCE, i] * bias[i] + np.sign(bias[i]) * p[HALF_PLAY, i]
            if at_link[i]:
                rotor[i] += beyond
            else:
                q[i] -= beyond


@compiled
def product(matrix, vector, out):
    """A matrix times a vector."""
    for i in range(out.size):
        out[i] = 0.0
        for j in range(out.size):
            out[i] += matrix[i, j] * vector[j]


@compiled
def damped(p, loose, mass, a, share, turning, h):
    """Mass with the rotors of joints without play, and in `a` with their damping over a step.

    `share` is the part of the damping that the speed at the end of a step feels; the rest feels
    the speed at its beginning. It is such that a free joint slows down as in continuous time. A
    step at the `turning` speed brings dry friction from nothing to its whole.
    """
    n = mass.shape[0]
    for i in range(n):
        for j in range(n):
            a[i, j] = mass[i, j]
        turning[i] = p[TURNING_SPEED, i] + p[PRESLIDING, i] / h
        inertia = p[ARMATURE, i]
        if not loose[i]:
            inertia += mass[i, i]
        slowing = h * p[DAMPING, i] / inertia
        share[i] = 0.5 + slowing / 12.0
        if slowing > 1e-3:
            share[i] = 1.0 / (1.0 - np.exp(-slowing)) - 1.0 / slowing
        if not loose[i]:
            mass[i, i] = inertia
            a[i, i] = inertia + h * share[i] * p[DAMPING, i]


@compiled
def dry_friction(p, i, speed, load):
    """Torque that dry friction may take at most [N m]."""
    dry = p[COULOMB, i] + p[LOAD_FRICTION, i] * abs(load)
    if p[STRIBECK, i] > 0.0:
        slow = abs(speed) / p[STRIBECK_SPEED, i]
        dry += p[STRIBECK, i] * np.exp(-(slow ** p[STRIBECK_EXPONENT, i]))
    fast = abs(speed) + p[TURNING_SPEED, i] + _CREEP
    return dry * fast / (fast + p[RISE_SPEED, i])


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
def shrunk(value, by):
    """A momentum after dry friction took what it can."""
    return value - min(max(value, -by), by)


@compiled
def speed_torque(p, i, speed, share):
    """What drag, direction, and the damping that feels this speed take [N m]."""
    curved = abs(speed) * (p[DRAG, i] * speed + p[SKEW, i])
    return curved + (1.0 - share) * p[DAMPING, i] * speed


@compiled
def bend(p, i, speed, turning):
    """How far the bristles are bent after a step [rad]."""
    if p[PRESLIDING, i] == 0.0:
        return 0.0
    return p[PRESLIDING, i] * min(max(speed / turning, -1.0), 1.0)


@compiled
def slowed(momentum, level, turning, inertia):
    """Speed that dry friction leaves; below the turning speed it is a damper.

    Speeds count from that at which the bristles' bend of the last step would carry nothing.
    """
    if turning > 0.0:
        slow = momentum / (inertia + level / turning)
        if abs(slow) <= turning:
            return slow
    return shrunk(momentum, level) / inertia


@compiled
def solve(p, joints, inverse, impulse, h):
    """Impulse on each link of a step [N m s]: friction, or what the gears carry."""
    level, n = joints.level, impulse.size
    for _ in range(_SWEEPS):
        change, largest = 0.0, 0.0
        for i in range(n):
            rest = joints.free[i] + joints.bent[i]
            for j in range(n):
                if j != i:
                    rest += inverse[i, j] * impulse[j]
            if joints.loose[i]:
                new = tie(p, i, joints, inverse[i, i], rest, h)
            else:
                held = rest / (inverse[i, i] + joints.turning[i] / level[i])
                new = -min(max(held, -level[i]), level[i])
            change = max(change, abs(new - impulse[i]))
            largest = max(largest, abs(new))
            impulse[i] = new
        if change <= _SETTLED * largest:
            return


@compiled
def tie(p, i, joints, mobility, rest, h):
    """Impulse through the gears: none within the play; beyond it a spring beside a damper."""
    level, turning = joints.level[i], joints.turning[i]
    twist = joints.rotor[i] - joints.q[i]
    inertia = p[ARMATURE, i] + h * joints.share[i] * p[DAMPING, i]
    momentum = p[ARMATURE, i] * joints.speed[i] + h * joints.torque[i] + inertia * joints.bent[i]
    half = p[HALF_PLAY, i]
    apart = twist + h * (slowed(momentum, level, turning, inertia) - rest)
    if abs(apart) <= half:
        return 0.0
    edge = half if apart > 0.0 else -half
    felt = h + p[GEAR_LAG, i]  # for which a change of the twist is felt
    yielding = felt * mobility + p[COMPLIANCE, i] / h
    for side in (1.0, -1.0):
        slip = (momentum - side * level) / inertia
        carried = (twist - edge + felt * (slip - rest)) / (felt / inertia + yielding)
        if side * (momentum - carried) > level + turning * inertia:
            return carried
    if turning > 0.0:
        held = inertia + level / turning
        return (twist - edge + felt * (momentum / held - rest)) / (felt / held + yielding)
    return (twist - edge - felt * rest) / yielding


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
            if p[PROFILE_ACCELERATION, i] < _NO_PROFILE:
                rate = planned(p, i, wanted, goal, pace, step)
                wanted = goal[i]
            made[k, i] = wanted + p[RATE_GAIN, i] * rate / p[STIFFNESS, i]
    return grid, made
