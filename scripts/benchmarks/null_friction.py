"""How the friction of the effect-free arms turns round: curves of speed, bristles of distance.

Equations of this benchmark's own. Curves: algebraic, s(u) = u / (1 + |u|^p)^(1/p), whose tail falls
as |u|^-p; arctangent, s(u) = 2/pi atan(pi u / 2). Bristles: Dahl (1968) with an exponent,
df/dx = (1 - f sgn v)^p / distance; LuGre with a constant level, which is Dahl of exponent one and
the damping of its bristle.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALGEBRAIC, ARCTANGENT, DAHL, LUGRE = range(4)
_STEPS_OF_NEWTON = 30
_ENOUGH = 1e-12  # of the momentum that a step begins with


class Shape(NamedTuple):
    """A way of turning round: its kind, and an exponent, or for LuGre the damping ratio."""

    kind: int
    number: float


SHAPES = {
    "algebraic_1": Shape(ALGEBRAIC, 1.0),
    "algebraic_1.5": Shape(ALGEBRAIC, 1.5),
    "algebraic_2": Shape(ALGEBRAIC, 2.0),
    "algebraic_3": Shape(ALGEBRAIC, 3.0),
    "arctangent": Shape(ARCTANGENT, 0.0),
    "dahl_0.5": Shape(DAHL, 0.5),
    "dahl_1.5": Shape(DAHL, 1.5),
    "dahl_2": Shape(DAHL, 2.0),
    "dahl_3": Shape(DAHL, 3.0),
    "lugre_0.1": Shape(LUGRE, 0.1),
    "lugre_0.7": Shape(LUGRE, 0.7),
}
"""By name. An algebraic tail of an exponent below one is none of them: the friction of such a joint
still grows in fast sliding, so that something is missing there."""


class Friction(NamedTuple):
    """Friction of n joints, each of shape (n,).

    Attributes:
        kind, number: of each joint's shape.
        scale: width [rad/s] of a curve, or distance [rad] of a bristle.
        level: Coulomb friction [N m].
        viscous: [N m s/rad].
        inertia: what LuGre's damping ratio refers to [kg m^2].
    """

    kind: NDArray[np.int64]
    number: Array
    scale: Array
    level: Array
    viscous: Array
    inertia: Array


@njit(cache=True)
def after_distance(bristle: float, exponent: float, way: float) -> float:
    """Dahl's bristle after a way in units of its distance: the exact solution, from one to one."""
    ahead = 1.0 if way >= 0.0 else -1.0
    room = max(1.0 - ahead * bristle, 0.0)
    if exponent == 1.0:
        room *= np.exp(-abs(way))
    elif exponent < 1.0:
        rest = room ** (1.0 - exponent) - (1.0 - exponent) * abs(way)
        room = max(rest, 0.0) ** (1.0 / (1.0 - exponent))
    elif room > 0.0:
        rest = room ** (1.0 - exponent) + (exponent - 1.0) * abs(way)
        room = rest ** (1.0 / (1.0 - exponent))
    return ahead * (1.0 - room)


@njit(cache=True)
def curve(kind: int, exponent: float, u: float) -> tuple[float, float]:
    """A smooth sign of speed in units of its width, and its slope."""
    if kind == ARCTANGENT:
        return 2.0 / np.pi * np.arctan(0.5 * np.pi * u), 1.0 / (1.0 + (0.5 * np.pi * u) ** 2)
    base = 1.0 + abs(u) ** exponent
    return u * base ** (-1.0 / exponent), base ** (-1.0 / exponent - 1.0)


@njit(cache=True)
def torque(friction, j, bristle, v, h):
    """Dry friction at the end of a step [N m], its slope over speed, and the bristle then."""
    kind, level, scale = friction.kind[j], friction.level[j], friction.scale[j]
    if kind == ALGEBRAIC or kind == ARCTANGENT:
        sign, slope = curve(kind, friction.number[j], v / scale)
        return level * sign, level * slope / scale, bristle
    exponent = friction.number[j] if kind == DAHL else 1.0
    end = after_distance(bristle, exponent, h * v / scale)
    room = max(1.0 - (1.0 if v >= 0.0 else -1.0) * end, 0.0)
    slope = h / scale * room**exponent
    if kind == DAHL:
        return level * end, level * slope, end
    damping = 2.0 * friction.number[j] * np.sqrt(level * scale * friction.inertia[j]) / h
    return level * end + damping * (end - bristle), (level + damping) * slope, end


@njit(cache=True)
def step(mass, load, friction, v, bristles, h):
    """One implicit step, in place: M (v' - v) = h (load - viscous v' - friction(v')).

    Args:
        mass: [kg m^2], shape (n, n), symmetric.
        load: torque of motors less that of Coriolis forces and gravity [N m], shape (n,).
        friction: of the joints.
        v: velocity [rad/s], shape (n,); overwritten.
        bristles: in units of the breaking torque, shape (n,); overwritten.
        h: [s].
    """
    n = v.size
    wanted = mass @ v + h * load
    new, residual, slope = v.copy(), np.empty(n), np.empty(n)
    enough = _ENOUGH * (np.abs(wanted).max() + h)
    size = _mismatch(mass, wanted, friction, new, bristles, h, residual, slope)
    for _ in range(_STEPS_OF_NEWTON):
        if size <= enough:
            break
        change = np.linalg.solve(mass + h * np.diag(slope), residual)
        share, before, best = 1.0, new.copy(), size
        while share > 1e-3:  # Newton's step may go beyond a kink
            new[:] = before - share * change
            size = _mismatch(mass, wanted, friction, new, bristles, h, residual, slope)
            if size < best:
                break
            share *= 0.5
    for j in range(n):
        _, _, bristles[j] = torque(friction, j, bristles[j], new[j], h)
    v[:] = new


@njit(cache=True)
def _mismatch(mass, wanted, friction, v, bristles, h, residual, slope):
    """Largest part of the residual [N m s]; the residual and the slope of friction in place."""
    residual[:] = mass @ v - wanted
    for j in range(v.size):
        tau, slope[j], _ = torque(friction, j, bristles[j], v[j], h)
        residual[j] += h * (tau + friction.viscous[j] * v[j])
        slope[j] += friction.viscous[j]
    return np.abs(residual).max()
