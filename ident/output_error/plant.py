"""Position servos, gears, and links in compiled form: commands in, positions out.

Links are one coupled rigid-body system; their mass matrix and the torque of gravity and speed are
formed for the middle of one sample, and held while servo, friction, and play take these. Speeds
stand half a step before positions, a step's torque is that of its middle, and damping takes over a
step what it would take in continuous time: a step that is too coarse would pass for inertia and
delay. A joint without play or twist moves as one with its rotor; one with them pushes through a
dead zone with a spring, without rebound. Friction rubs at the rotor, through bristles in series
with a damper, whose bend is remembered, or in part at the link of such a joint, and a part of what
turns with the gears moves with that link. All joints' impulses of a step are found by Gauss-Seidel
sweeps, each joint's own exactly.
"""

from collections import namedtuple

import numpy as np

from ident.dynamics.compiled_chain import inverse_dynamics, invert, mass_matrix, workspace
from ident.output_error.servo import (
    ARMATURE,
    COMPLIANCE,
    COULOMB,
    DAMPING,
    DELAY,
    DRAG,
    GEAR_LAG,
    HALF_PLAY,
    LINK_ARMATURE,
    LINK_FRICTION,
    LOAD_FRICTION,
    LOAD_SIDE,
    NO_PROFILE,
    OFFSET,
    PRESLIDING,
    PROFILE_ACCELERATION,
    RISE_SPEED,
    SKEW,
    SPEED_GAIN,
    SPRING,
    STRIBECK,
    STRIBECK_EXPONENT,
    STRIBECK_SPEED,
    TURNING_SPEED,
    ZERO,
    commanded,
    gathered,
    planned,
    servo,
)
from wamctl.arm.compilation import compiled

_SWEEPS = 40
_HELD_S = 0.025  # for which mass and gravity are held at most: some microradians on a hobby arm
_CREEP = 1e-6  # rad/s: slower than anything that is seen
_SETTLED = 1e-4  # of the largest impulse of a step: less than a thousandth of a 12-bit step

Joints = namedtuple(
    "Joints", "loose q rotor speed torque free level slowing share turning bent edge rub"
)
"""What a step knows of the joints, shape (n,) each, written in place: whether play or twist is
between link and rotor; their positions [rad] and the rotor's speed [rad/s]; the motor's torque
[N m]; the link's speed without the impulses; the largest impulse of friction [N m s]; damping and
bristles, as `damped` and `bend` have them; and, at the links of loose joints, the largest impulse
of friction, and that of this step [N m s]."""


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
    slowing, edge, rub = np.zeros(n), np.zeros(n), np.zeros(n)
    was, ahead, before = motion.speed.copy(), np.zeros(n), 1.0
    loose = np.empty(n, dtype=np.bool_)
    at, goal, pace = np.zeros(n, dtype=np.int64), np.empty(n), motion.speed.copy()
    for i in range(n):
        loose[i] = p[HALF_PLAY, i] > 0.0 or p[COMPLIANCE, i] > 0.0
        q[i] = motion.start[i] + p[ZERO, i]
        rotor[i] = q[i]
        out[0, i] = motion.start[i]
        goal[i], _ = commanded(motion, at, i, motion.t[0] - p[DELAY, i], step)
    joints = Joints(
        loose, q, rotor, speed, torque, free, level, slowing, share, turning, bent, edge, rub
    )
    inverse_dynamics(chain, delta, q, still, still, w, bias)
    gathered(p, motion, goal, bias, integral)
    twisted(p, at_link, loose, bias, q, rotor)
    for k in range(samples - 1):
        whole = motion.t[k + 1] - motion.t[k]
        parts = max(1, int(np.ceil(whole / _HELD_S - 1e-6)))
        span = whole / parts
        for part in range(parts):
            steps = max(1, int(np.ceil(span / step - 1e-6)))
            h = span / steps
            for i in range(n):  # positions stand at the steps' beginnings, speeds before these
                change = 0.5 * span / before * (v[i] - was[i])
                was[i], ahead[i] = v[i], v[i] + change
                middle[i] = q[i] + 0.5 * (span - h) * v[i]
            before = span
            inverse_dynamics(chain, delta, middle, ahead, still, w, bias)
            mass_matrix(chain, delta, w, mass)
            damped(p, loose, mass, a, slowing, share, turning, h)
            invert(a, inverse)
            for s in range(steps):
                t = motion.t[k] + part * span + s * h
                for i in range(n):
                    here = (q[i] if at_link[i] else rotor[i]) - p[ZERO, i]
                    wanted, rate = commanded(motion, at, i, t - 0.5 * h - p[DELAY, i], h)
                    if p[PROFILE_ACCELERATION, i] < NO_PROFILE:
                        aim = goal[i]
                        rate = planned(p, i, wanted, goal, pace, h)
                        wanted = aim
                    given = servo(p, i, wanted - here, rate, integral, h)
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
        for i in range(n):
            out[k + 1, i] = (q[i] if at_link[i] else rotor[i]) - p[ZERO, i]


@compiled
def turn_on(p, joints, v, impulse, h):
    """Links and rotors at the end of a step; `v` holds what the impulses did to the links."""
    slowing, share, bent = joints.slowing, joints.share, joints.bent
    for i in range(v.size):
        v[i] += joints.free[i]
        joints.q[i] += h * v[i]
        if joints.loose[i]:
            own = before_gears(p, i)
            left = own * joints.speed[i] + h * joints.torque[i]
            left -= impulse[i] - joints.rub[i]
            inertia = own + h * share[i] * slowing[i]
            left += inertia * bent[i]
            joints.speed[i] = slowed(left, joints.level[i], joints.turning[i], inertia) - bent[i]
            joints.rotor[i] += h * joints.speed[i]
        else:
            joints.speed[i], joints.rotor[i] = v[i], joints.q[i]
        bent[i] = bend(p, i, joints.speed[i] + bent[i], joints.turning[i]) / h


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
def before_gears(p, i):
    """Inertia that turns with the rotor of a loose joint [kg m^2]."""
    return (1.0 - p[LINK_ARMATURE, i]) * p[ARMATURE, i]


@compiled
def product(matrix, vector, out):
    """A matrix times a vector."""
    for i in range(out.size):
        out[i] = 0.0
        for j in range(out.size):
            out[i] += matrix[i, j] * vector[j]


@compiled
def damped(p, loose, mass, a, slowing, share, turning, h):
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


@compiled
def passing(p, i, link, motor):
    """Torque that passes the gears, which their friction is in proportion to [N m].

    Of the two sides' torques that of the one that drives is the larger, by the gears' losses.
    """
    return abs(link) + p[LOAD_SIDE, i] * max(abs(motor) - abs(link), 0.0)


@compiled
def dry_friction(p, i, speed, load):
    """Torque that dry friction may take at most [N m]."""
    dry = p[COULOMB, i] + p[LOAD_FRICTION, i] * load
    if p[STRIBECK, i] > 0.0:
        slow = abs(speed) / p[STRIBECK_SPEED, i]
        dry += p[STRIBECK, i] * np.exp(-(slow ** p[STRIBECK_EXPONENT, i]))
    fast = abs(speed) + p[TURNING_SPEED, i] + _CREEP
    return dry * fast / (fast + p[RISE_SPEED, i])


@compiled
def shrunk(value, by):
    """A momentum after dry friction took what it can."""
    return value - min(max(value, -by), by)


@compiled
def speed_torque(p, i, speed, slowing, share):
    """What drag, direction, and the damping that feels this speed take [N m]."""
    curved = abs(speed) * (p[DRAG, i] * speed + p[SKEW, i])
    return curved + (1.0 - share) * slowing * speed


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
                new = rubbed(p, i, joints, inverse[i, i], rest, h)
            else:
                held = rest / (inverse[i, i] + joints.turning[i] / level[i])
                new = -min(max(held, -level[i]), level[i])
            change = max(change, abs(new - impulse[i]))
            largest = max(largest, abs(new))
            impulse[i] = new
        if change <= _SETTLED * largest:
            return


@compiled
def rubbed(p, i, joints, mobility, rest, h):
    """Impulse on the link of a loose joint: what the gears carry, less what rubs at the link."""
    carried = tie(p, i, joints, mobility, rest + mobility * joints.rub[i], h)
    if joints.edge[i] > 0.0:
        held = (rest - joints.bent[i]) / mobility + carried
        joints.rub[i] = -min(max(held, -joints.edge[i]), joints.edge[i])
    return carried + joints.rub[i]


@compiled
def tie(p, i, joints, mobility, rest, h):
    """Impulse through the gears: none within the play; beyond it a spring beside a damper."""
    level, turning = joints.level[i], joints.turning[i]
    twist = joints.rotor[i] - joints.q[i]
    own = before_gears(p, i)
    inertia = own + h * joints.share[i] * joints.slowing[i]
    momentum = own * joints.speed[i] + h * joints.torque[i] + inertia * joints.bent[i]
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
