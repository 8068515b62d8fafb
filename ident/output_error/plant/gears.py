"""Gears and friction of servo-driven joints in compiled form: what a step's impulses do.

A joint without play or twist moves as one with its rotor; one with them pushes through a dead zone
with a spring, without rebound. Friction rubs at the rotor, through bristles in series with a
damper, whose bend is remembered, or in part at the link of such a joint, and a part of what turns
with the gears moves with that link. All joints' impulses of a step are found by Gauss-Seidel
sweeps, each joint's own exactly.
"""

from collections import namedtuple

import numpy as np

from ident.output_error.plant.servo import (
    ARMATURE,
    COMPLIANCE,
    COULOMB,
    DRAG,
    GEAR_LAG,
    HALF_PLAY,
    LINK_ARMATURE,
    LOAD_FRICTION,
    LOAD_SIDE,
    PRESLIDING,
    RISE_SPEED,
    SKEW,
    STRIBECK,
    STRIBECK_EXPONENT,
    STRIBECK_SPEED,
    TURNING_SPEED,
)
from wamctl.arm.compilation import compiled

_SWEEPS = 40
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
def before_gears(p, i):
    """Inertia that turns with the rotor of a loose joint [kg m^2]."""
    return (1.0 - p[LINK_ARMATURE, i]) * p[ARMATURE, i]


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
