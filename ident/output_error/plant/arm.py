"""Position servos, gears, and links in compiled form: commands in, positions out.

Links are one coupled rigid-body system; their mass matrix and the torque of gravity and speed are
formed for the middle of a span of one or some samples, and held while servo, friction, and play
take these. Speeds stand half a step before positions, a step's torque is that of its middle, and
damping takes over a step what it would take in continuous time: a step that is too coarse would
pass for inertia and delay.
"""

import numpy as np

from ident.dynamics.compiled_chain import inverse_dynamics, invert, mass_matrix, workspace
from ident.output_error.plant.gears import (
    Joints,
    before_gears,
    dry_friction,
    passing,
    solve,
    speed_torque,
    turn_on,
)
from ident.output_error.plant.servo import (
    ARMATURE,
    COMPLIANCE,
    DAMPING,
    DELAY,
    FED,
    HALF_PLAY,
    INTEGRATED,
    LINK_FRICTION,
    NO_PROFILE,
    OFFSET,
    PRESLIDING,
    PROFILE_ACCELERATION,
    SPEED_GAIN,
    SPRING,
    STEPS,
    TURNING_SPEED,
    ZERO,
    begun,
    commanded,
    fed_forward,
    gathered,
    planned,
    servo,
)
from wamctl.arm.compilation import compiled

_HELD_S = 0.025  # for which mass and gravity are held at most: some microradians on a hobby arm


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
    p, w = settings, workspace(n)
    bias, still, mass = np.zeros(n), np.zeros(n), np.zeros((n, n))
    a, inverse, links = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    q, v = motion.start + p[ZERO], motion.speed.copy()
    rotor, speed = q.copy(), motion.speed.copy()
    impulse, free, momentum = np.zeros(n), np.zeros(n), np.zeros(n)
    torque, level, middle = np.zeros(n), np.zeros(n), np.zeros(n)
    share, bent, turning = np.zeros(n), np.zeros(n), np.zeros(n)
    slowing, edge, rub = np.zeros(n), np.zeros(n), np.zeros(n)
    was, ahead, before = motion.speed.copy(), np.zeros(n), 1.0
    loose = (p[HALF_PLAY] > 0.0) | (p[COMPLIANCE] > 0.0)
    out[0] = motion.start
    joints = Joints(
        loose, q, rotor, speed, torque, free, level, slowing, share, turning, bent, edge, rub
    )
    inverse_dynamics(chain, delta, q, still, still, w, bias)
    at, held = begun(p, motion, step)
    fed, integral = held[FED], held[INTEGRATED]
    fed_forward(chain, delta, p, motion, at, held, motion.t[0], 0.0)
    gathered(p, motion, held, bias)
    twisted(p, at_link, loose, bias, q, rotor)
    k = 0
    while k < samples - 1:
        last = k + 1
        while last < samples - 1 and motion.t[last + 1] - motion.t[k] <= _HELD_S:
            last += 1
        parts = pieces(motion.t[last] - motion.t[k], _HELD_S)  # several of a sample, or one of some
        span = (motion.t[last] - motion.t[k]) / parts
        for part in range(parts):
            to_middle(q, v, was, span / before, ahead, middle, span - min(span, step))
            before = span
            fed_forward(chain, delta, p, motion, at, held, motion.t[k] + part * span, span)
            inverse_dynamics(chain, delta, middle, ahead, still, w, bias)
            mass_matrix(chain, delta, w, links)
            for m in range(k, last):
                whole = (motion.t[m + 1] - motion.t[m]) / parts
                steps = pieces(whole, step)
                h = whole / steps
                damped(p, joints, links, mass, a, h)
                invert(a, inverse)
                for s in range(steps):
                    t = motion.t[m] + part * whole + (s - 0.5) * h
                    for i in range(n):
                        here = (q[i] if at_link[i] else rotor[i]) - p[ZERO, i]
                        wanted, rate = commanded(motion, at, STEPS, i, t - p[DELAY, i], h)
                        if p[PROFILE_ACCELERATION, i] < NO_PROFILE:
                            wanted, rate = planned(p, i, wanted, held, h)
                        given = servo(p, i, wanted - here, rate, fed[i], integral, h)
                        torque[i] = given - p[OFFSET, i]
                        torque[i] -= speed_torque(p, i, speed[i], slowing[i], share[i])
                        level[i] = h * dry_friction(p, i, speed[i], passing(p, i, bias[i], given))
                        momentum[i] = -h * (bias[i] + p[SPRING, i] * q[i])
                        for j in range(n):
                            momentum[i] += mass[i, j] * v[j]
                        if loose[i]:
                            edge[i] = p[LINK_FRICTION, i] * level[i]
                            level[i] -= edge[i]
                        else:
                            momentum[i] += h * torque[i]
                    product(inverse, momentum, free)
                    solve(p, joints, inverse, impulse, h)
                    product(inverse, impulse, v)
                    turn_on(p, joints, v, impulse, h)
                out[m + 1] = np.where(at_link, q, rotor) - p[ZERO]
        k = last


@compiled
def to_middle(q, v, was, longer, ahead, middle, over):
    """Speeds and positions at the middle of a span: its first step's speeds stand before it."""
    for i in range(q.size):
        ahead[i] = v[i] + 0.5 * longer * (v[i] - was[i])
        was[i] = v[i]
        middle[i] = q[i] + 0.5 * over * v[i]


@compiled
def pieces(whole, longest):
    """How many pieces of at most a length a whole has."""
    return max(1, int(np.ceil(whole / longest - 1e-6)))


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
def damped(p, joints, links, mass, a, h):
    """Links' mass with the rotors of joints without play, and in `a` with damping over a step.

    `share` is the part of the damping that the speed at the end of a step feels; the rest feels
    the speed at its beginning. It is such that a free joint slows down as in continuous time. A
    step at the `turning` speed brings dry friction from nothing to its whole.
    """
    n, loose = mass.shape[0], joints.loose
    slowing, share, turning = joints.slowing, joints.share, joints.turning
    for i in range(n):
        for j in range(n):
            a[i, j] = mass[i, j] = links[i, j]
        turning[i] = p[TURNING_SPEED, i] + p[PRESLIDING, i] / h
        inertia = p[ARMATURE, i]
        slowing[i] = p[SPEED_GAIN, i] + p[DAMPING, i]
        if loose[i]:
            behind = p[LINK_FRICTION, i] * p[DAMPING, i]
            slowing[i] -= behind
            a[i, i] += 0.5 * h * behind
            inertia = before_gears(p, i)
            a[i, i] += p[ARMATURE, i] - inertia
            mass[i, i] += p[ARMATURE, i] - inertia - 0.5 * h * behind
        else:
            inertia += mass[i, i]
        lost = h * slowing[i] / inertia
        share[i] = 0.5 + lost / 12.0
        if lost > 1e-3:
            share[i] = 1.0 / (1.0 - np.exp(-lost)) - 1.0 / lost
        if not loose[i]:
            mass[i, i] = inertia
            a[i, i] = inertia + h * share[i] * slowing[i]
