"""Friction of the benchmark's arms, integrated in steps of 0.2 to 0.4 ms.

Rigid elements stick and slide by an active set; bristles follow their differential equations;
smooth curves are linearised about each step's start. Nothing of this is shared with `ident`.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Friction(NamedTuple):
    """Friction elements, m of them.

    Attributes:
        rows: speed of each from the generalised speeds, shape (m, size).
        kind: of reversal, shape (m,): 0 stick, 1 Dahl, 2 LuGre, 3 erf, 4 smoothstep, 5 Gudermann,
            6 slips, 7 a curve with a long tail,
            8 one with a short tail, 9 an arctangent.
        scale: width [rad/s] or distance [rad], shape (m,).
        level: Coulomb friction [N m], shape (m,).
        unequal: relative difference by direction, shape (m,).
        curve: form of the extra friction at low speed, shape (m,): 0 none, then as in `_fade`.
        curve_size: [N m], shape (m,).
        curve_speed: [rad/s], shape (m,).
        viscous: [N m s/rad], shape (m,).
    """

    rows: Array
    kind: NDArray[np.int64]
    scale: Array
    level: Array
    unequal: Array
    curve: NDArray[np.int64]
    curve_size: Array
    curve_speed: Array
    viscous: Array


class Spring(NamedTuple):
    """A transmission that gives: the joint (-1: none), stiffness [N m/rad], half play [rad]."""

    joint: int
    stiffness: float
    play: float


@njit(cache=True)
def _fade(curve, u):
    u = abs(u)
    if curve == 1:
        return np.exp(-u * u)
    if curve == 2:
        return 1.0 / (1.0 + u * u)
    if curve == 3:
        return 1.0 / (1.0 + u)
    if curve == 4:
        return 1.0 / np.cosh(u)
    if curve == 5:
        return max(0.0, 1.0 - u / 2.0)
    return 0.0


@njit(cache=True)
def _shape(kind, u):
    """Smooth sign and its slope."""
    if kind == 3:
        from_erf = _erf(u)
        return from_erf, 1.1283791671 * np.exp(-u * u)
    if kind == 4:
        if abs(u) >= 1.5:
            return (1.0 if u > 0 else -1.0), 0.0
        w = u / 1.5
        return 1.5 * w - 0.5 * w**3, (1.5 - 1.5 * w * w) / 1.5
    if kind == 7:
        return 4.0 * u / (1.0 + 4.0 * abs(u)), 4.0 / (1.0 + 4.0 * abs(u)) ** 2
    if kind == 8:
        return u / np.sqrt(1.0 + u * u), (1.0 + u * u) ** -1.5
    if kind == 9:
        return 2.0 / np.pi * np.arctan(2.0 * u), 4.0 / np.pi / (1.0 + 4.0 * u * u)
    c = min(abs(u), 40.0)
    return (
        2.0 / np.pi * np.arctan(np.sinh(np.sign(u) * c * np.pi / 2.0)),
        1.0 / np.cosh(c * np.pi / 2.0),
    )


@njit(cache=True)
def _erf(u):
    """Abramowitz and Stegun 7.1.26."""
    s = 1.0 if u >= 0 else -1.0
    u = abs(u)
    t = 1.0 / (1.0 + 0.3275911 * u)
    poly = t * (
        0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))
    )
    return s * (1.0 - poly * np.exp(-u * u))


@njit(cache=True)
def integrate(mass, resist, commands, friction, spring, state, h):
    """Steps of length h with constant inertia and bias; `state` is (q, v, stretch, stuck)."""
    q, v, stretch, stuck = state
    size, m = q.size, friction.level.size
    slope, force = np.zeros(m), 0.0
    right, new = np.empty(size), np.empty(size)
    system, inverse = np.empty((size, size)), np.empty((size, size))
    speed, sign = np.empty(m), np.empty(m)
    rigid = spring.joint < 0
    for e in range(m):
        rigid = rigid and friction.kind[e] == 0
    for step in range(commands.shape[0]):
        fresh = step == 0 or not rigid
        for i in range(size):
            right[i] = h * (commands[step, i] - resist[i])
            for j in range(size):
                right[i] += mass[i, j] * v[j]
        if fresh:
            system[:] = mass
        if spring.joint >= 0:
            _wind(system, right, q, v, spring, h)
        for e in range(m):
            speed[e] = _dot(friction.rows, e, v)
            force, slope[e] = _element(friction, e, speed[e], stretch, h)
            if fresh or friction.kind[e] != 0:
                base = 0.0 if friction.kind[e] == 0 else force - slope[e] * speed[e]
                _add(system, right, friction.rows[e], base, slope[e] if fresh else 0.0, h)
        if fresh:
            inverse = np.ascontiguousarray(np.linalg.inv(system))
        _with_sticking(inverse, right, friction, (speed, sign, new), stuck, h)
        for e in range(m):
            _relax(friction, e, _dot(friction.rows, e, new), stretch, h)
        for i in range(size):
            v[i] = new[i]
            q[i] += h * new[i]


@njit(cache=True)
def _dot(rows, e, v):
    total = 0.0
    for i in range(v.size):
        total += rows[e, i] * v[i]
    return total


@njit(cache=True)
def _add(system, right, row, force, slope, h):
    for i in range(row.size):
        if row[i] != 0.0:
            right[i] -= h * force * row[i]
            for j in range(row.size):
                system[i, j] += h * slope * row[i] * row[j]


@njit(cache=True)
def _wind(system, right, q, v, spring, h):
    """The spring between motor and link, linearised about the end of the step."""
    j, m = spring.joint, q.size - 1
    twist = q[m] - q[j]
    reach = abs(twist) - spring.play
    if reach <= 0.0:
        return
    torque = spring.stiffness * reach * (1.0 if twist > 0 else -1.0)
    damping = 0.02 * np.sqrt(spring.stiffness * 0.01)
    k = h * (h * spring.stiffness + damping)
    system[m, m] += k
    system[j, j] += k
    system[m, j] -= k
    system[j, m] -= k
    right[m] -= h * torque
    right[j] += h * torque


@njit(cache=True)
def _level(friction, e, speed):
    level = friction.level[e]
    level += friction.curve_size[e] * _fade(friction.curve[e], speed / friction.curve_speed[e])
    if speed > 0.0:
        level *= 1.0 + friction.unequal[e]
    elif speed < 0.0:
        level *= 1.0 - friction.unequal[e]
    return level


@njit(cache=True)
def _element(friction, e, speed, stretch, h):
    """Friction torque at the start of the step and its slope, viscous part included."""
    kind, viscous = friction.kind[e], friction.viscous[e]
    level = _level(friction, e, speed)
    if kind == 0:
        return 0.0, viscous
    if kind >= 3 and kind != 6:
        shape, tangent = _shape(kind, speed / friction.scale[e])
        return level * shape + viscous * speed, level * tangent / friction.scale[e] + viscous
    stiffness = level / friction.scale[e]
    if kind == 6:
        torque, tangent = 0.0, 0.0
        for i in range(3):
            share = (0.5, 0.3, 0.2)[i]
            breaks = level * share
            k = 2.0 * breaks / friction.scale[e] / (1.0, 2.0, 4.0)[i]
            ahead = stretch[e, i] + h * speed
            if abs(k * ahead) < breaks:
                torque += k * ahead
                tangent += k * h
            else:
                torque += breaks * (1.0 if ahead > 0 else -1.0)
        return torque + viscous * speed, tangent + viscous
    decay = 1.0 + h * abs(speed) * stiffness / max(level, 1e-9)
    z = (stretch[e, 0] + h * speed) / decay
    torque, tangent = stiffness * z, stiffness * h / decay
    if kind == 2:
        damping = 0.05 * np.sqrt(stiffness * 0.01)
        torque += damping * (z - stretch[e, 0]) / h
        tangent += damping / decay
    return torque + viscous * speed, tangent + viscous


@njit(cache=True)
def _relax(friction, e, speed, stretch, h):
    """Bristles at the end of the step."""
    kind = friction.kind[e]
    if kind == 1 or kind == 2:
        stretch[e, 0] = (stretch[e, 0] + h * speed) / (1.0 + h * abs(speed) / friction.scale[e])
    elif kind == 6:
        for i in range(3):
            most = friction.scale[e] * (1.0, 2.0, 4.0)[i] / 2.0
            stretch[e, i] = min(max(stretch[e, i] + h * speed, -most), most)


@njit(cache=True)
def _with_sticking(inverse, right, friction, work, stuck, h):
    """Velocity at the end of the step, rigid friction elements stuck or sliding consistently."""
    speed, sign, new = work
    size, m = right.size, speed.size
    for e in range(m):
        sign[e] = 0.0
        if friction.kind[e] == 0 and not stuck[e]:
            sign[e] = 1.0 if speed[e] > 0.0 else -1.0
    push, who, held = np.empty(size), np.empty(m, dtype=np.int64), 0
    for _ in range(12):
        held = 0
        push[:] = right
        for e in range(m):
            if friction.kind[e] != 0 or friction.level[e] <= 0.0:
                continue
            if sign[e] == 0.0:
                who[held] = e
                held += 1
                continue
            level = _level(friction, e, 0.0 if stuck[e] else speed[e])
            if stuck[e] or speed[e] == 0.0:
                level *= 1.0 + friction.unequal[e] * sign[e]
            for i in range(size):
                push[i] -= h * sign[e] * level * friction.rows[e, i]
        new[:] = inverse @ push
        worst, place, direction = 1.0, -1, 0.0
        if held > 0:
            impulse = _hold(inverse, friction.rows, who[:held], new)
            for i in range(held):
                e = who[i]
                way = 1.0 if impulse[i] > 0.0 else -1.0
                most = h * _level(friction, e, 0.0) * (1.0 + friction.unequal[e] * way)
                if abs(impulse[i]) > most * worst:
                    worst, place, direction = abs(impulse[i]) / most, e, way
        changed = place >= 0
        if changed:
            sign[place] = direction
        for e in range(m):
            if friction.kind[e] == 0 and sign[e] != 0.0 and not stuck[e]:
                if _dot(friction.rows, e, new) * sign[e] < 0.0:
                    sign[e], stuck[e], changed = 0.0, True, True
        if not changed:
            break
    for e in range(m):
        stuck[e] = friction.kind[e] == 0 and sign[e] == 0.0


@njit(cache=True)
def _hold(inverse, rows, who, new):
    """Impulses that bring the held elements to rest; `new` becomes the velocity with them."""
    held = rows[who]
    response = inverse @ held.T
    stiff = held @ response + 1e-12 * np.eye(who.size)
    impulse = np.linalg.solve(stiff, held @ new)
    new -= response @ impulse
    return impulse
