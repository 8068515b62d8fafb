"""One step of an arm with dry friction, at the level of velocities, so that a joint truly sticks.

Over a step h the arm obeys M (v' - v) = h (tau - B (v + v') / 2 - D^T f): each friction torque f
lies between its bounds and opposes its sliding speed s = D v', that is, f is at its upper bound
while s > 0, at its lower bound while s < 0, and between them only while s = 0 (the midpoint rule
with Coulomb friction of Moreau; a box-constrained linear complementarity problem in f).
"""

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.arrays import Array
from wamctl.arm.compilation import compiled

_MOST_CHANGES = 200
_RIDGE = 1e-12  # keeps frictions that hold the same joints apart
_SPEED_TOLERANCE = 1e-12  # [rad/s]


@compiled
def step(
    mass: Array,
    load: Array,
    motion: Array,
    linear: Array,
    stops: Array,
    slides: Array,
    friction: Array,
    h: float,
) -> None:
    """Move on by one step, in place.

    Args:
        mass: mass matrix of the links at the middle of the step [kg m^2], shape (n, n); only its
            upper triangle is read.
        load: torque on the joints, less that of Coriolis and centrifugal forces and of gravity at
            the middle of the step [N m], shape (n,).
        motion: position [rad] and velocity [rad/s], then both as expected at the middle of the
            next step, shape (4, n); overwritten.
        linear: added inertia [kg m^2] and viscous matrix B [N m s/rad], shape (2, n, n).
        stops: lower and upper end stop [rad], their stiffness [N m/rad] and damping [N m s/rad],
            shape (4, n).
        slides: sliding speeds of the k further dry frictions from joint speeds, shape (k, n); the
            lower rows of D, whose upper ones are the unit matrix.
        friction: lower bounds, upper bounds and present values of all dry frictions [N m], those
            of the joints first, shape (3, n + k); the values are overwritten, whether they kept the
            bounds or not.
        h: time step [s].
    """
    n = load.shape[0]
    for r in range(friction.shape[1]):
        friction[2, r] = min(max(friction[2, r], friction[0, r]), friction[1, r])
    a = np.empty((n, n))
    push = np.empty(n)
    before = motion[1].copy()
    drag = linear[1].copy()
    for i in range(n):
        push[i] = h * load[i]
        beyond = _beyond(motion[2, i], stops[0, i], stops[1, i])
        if beyond != 0.0:
            push[i] -= h * stops[2, i] * beyond
            if beyond * motion[1, i] > 0.0:
                drag[i, i] += stops[3, i]
    for i in range(n):
        for j in range(n):
            m = (mass[i, j] if j >= i else mass[j, i]) + linear[0, i, j]
            half = 0.5 * h * drag[i, j]
            a[i, j] = m + half
            push[i] += (m - half) * before[j]
    if not _goes_on_as_before(a, push, slides, friction, motion[1], h):
        _start_or_stop(a, push, slides, friction, motion[1], h)
    for i in range(n):
        motion[0, i] = motion[2, i] + 0.5 * h * motion[1, i]
        motion[2, i] = motion[0, i] + 0.5 * h * motion[1, i]
        motion[3, i] = 1.5 * motion[1, i] - 0.5 * before[i]


@compiled
def _beyond(q: float, lower: float, upper: float) -> float:
    """How far a joint is pressed into its upper stop (positive) or lower stop (negative)."""
    return max(q - upper, 0.0) + min(q - lower, 0.0)


@compiled
def _goes_on_as_before(
    a: Array, push: Array, slides: Array, friction: Array, velocity: Array, h: float
) -> bool:
    """The short way: what slid slides on in its direction, and the joints that stuck stay.

    Friction and velocity after the step, in place, from M + h B / 2 = a; false, and nothing is
    changed, when that is not how it goes on.
    """
    n, rows = velocity.shape[0], friction.shape[1]
    lower, upper, f = friction[0], friction[1], friction[2]
    free = np.empty(n, dtype=np.int64)
    count = 0
    for i in range(n):
        if not lower[i] < f[i] < upper[i]:
            free[count] = i
            count += 1
    moving = np.empty((count, count))
    after = np.empty(count)
    for i in range(count):
        after[i] = push[free[i]] - h * f[free[i]]
        for j in range(count):
            moving[i, j] = a[free[i], free[j]]
    for r in range(n, rows):
        if lower[r] < f[r] < upper[r]:
            return False
        for i in range(count):
            after[i] -= h * f[r] * slides[r - n, free[i]]
    _factorise(moving, count)
    _solve(moving, after, count)
    found = np.zeros(n)
    for i in range(count):
        found[free[i]] = after[i]
    held = np.empty(n)
    for i in range(n):
        held[i] = push[i]
        for j in range(n):
            held[i] -= a[i, j] * found[j]
        for r in range(n, rows):
            held[i] -= h * f[r] * slides[r - n, i]
        if lower[i] < f[i] < upper[i] and not h * lower[i] < held[i] < h * upper[i]:
            return False
    for r in range(rows):
        s = _slide(slides, found, r)
        if lower[r] < upper[r] and (
            (f[r] == lower[r] and s > 0.0) or (f[r] == upper[r] and s < 0.0)
        ):
            return False
    for i in range(n):
        if lower[i] < f[i] < upper[i]:
            f[i] = held[i] / h
        velocity[i] = found[i]
    return True


@compiled
def _start_or_stop(
    a: Array, push: Array, slides: Array, friction: Array, velocity: Array, h: float
) -> None:
    """The long way: friction and velocity after the step, in place, whatever begins or ends."""
    n, rows = velocity.shape[0], friction.shape[1]
    lower, upper, f = friction[0], friction[1], friction[2]
    _factorise(a, n)
    velocity[:] = push
    _solve(a, velocity, n)
    response = np.zeros((rows, n))  # change of velocity per friction torque
    for r in range(rows):
        if r < n:
            response[r, r] = h
        else:
            response[r] = h * slides[r - n]
        _solve(a, response[r], n)
    g = np.empty((rows, rows))
    speed = np.empty(rows)
    for r in range(rows):
        speed[r] = _slide(slides, velocity, r)
        for c in range(rows):
            g[r, c] = _slide(slides, response[c], r)
    _find_friction(g, speed, lower, upper, f)
    for i in range(n):
        for r in range(rows):
            velocity[i] -= response[r, i] * f[r]
    for i in range(n):
        if lower[i] < f[i] < upper[i]:
            velocity[i] = 0.0


@compiled
def _slide(slides: Array, velocity: Array, row: int) -> float:
    """A row of D times a velocity."""
    n = velocity.shape[0]
    if row < n:
        return velocity[row]
    total = 0.0
    for j in range(n):
        total += slides[row - n, j] * velocity[j]
    return total


@compiled
def _find_friction(g: Array, speed: Array, lower: Array, upper: Array, f: Array) -> None:
    """Friction torques f within their bounds that oppose the speeds speed - g f; in place.

    They minimise f^T g f / 2 - speed^T f within the bounds. An active-set method: torques are
    either at a bound or free; a free one that would leave its bounds stops there, and when none
    does, the one whose bound is the most wrong is set free (Nocedal and Wright, chapter 16.5).
    """
    rows = f.shape[0]
    free = np.empty(rows, dtype=np.bool_)
    for r in range(rows):
        free[r] = lower[r] < f[r] < upper[r]
    for _ in range(_MOST_CHANGES):
        stopped = _go_towards_rest(g, speed, lower, upper, f, free)
        if stopped >= 0:
            free[stopped] = False
            continue
        wrong = _most_wrong_bound(g, speed, lower, upper, f, free)
        if wrong < 0:
            return
        free[wrong] = True


@compiled
def _go_towards_rest(
    g: Array, speed: Array, lower: Array, upper: Array, f: Array, free: NDArray[np.bool_]
) -> int:
    """Change the free torques until their speeds vanish, or the first one meets its bound.

    Returns the one that has met its bound; -1 for none.
    """
    inside = np.nonzero(free)[0]
    count = inside.shape[0]
    a = np.empty((count, count))
    change = np.empty(count)
    for i in range(count):
        change[i] = _speed(g, speed, f, inside[i])
        for j in range(count):
            a[i, j] = g[inside[i], inside[j]]
        a[i, i] *= 1.0 + _RIDGE
    _factorise(a, count)
    _solve(a, change, count)
    share, first = 1.0, -1
    for i in range(count):
        r = inside[i]
        room = upper[r] - f[r] if change[i] > 0.0 else lower[r] - f[r]
        if abs(change[i]) * share > abs(room):
            share, first = room / change[i], i
    for i in range(count):
        f[inside[i]] += share * change[i]
    if first < 0:
        return -1
    stopped = inside[first]
    f[stopped] = upper[stopped] if change[first] > 0.0 else lower[stopped]
    return stopped


@compiled
def _most_wrong_bound(
    g: Array, speed: Array, lower: Array, upper: Array, f: Array, free: NDArray[np.bool_]
) -> int:
    """The torque at a bound that its speed should push away from it the most; -1 for none."""
    worst, found = _SPEED_TOLERANCE, -1
    for r in range(f.shape[0]):
        if not free[r] and lower[r] < upper[r]:
            s = _speed(g, speed, f, r)
            wrong = -s if f[r] == upper[r] else s
            if wrong > worst:
                worst, found = wrong, r
    return found


@compiled
def _speed(g: Array, speed: Array, f: Array, row: int) -> float:
    s = speed[row]
    for c in range(f.shape[0]):
        s -= g[row, c] * f[c]
    return s


@compiled
def _factorise(a: Array, n: int) -> None:
    """Cholesky factor of a positive definite matrix into its lower triangle, in place.

    In loops of our own: LAPACK, to which numba hands `np.linalg.solve`, takes a third longer for
    a whole step of seven joints (2.1 for 1.6 us).
    """
    for j in range(n):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        a[j, j] = np.sqrt(a[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]


@compiled
def _solve(factor: Array, x: Array, n: int) -> None:
    """Solution for a Cholesky factor from `_factorise`, in place of the right-hand side."""
    for i in range(n):
        for k in range(i):
            x[i] -= factor[i, k] * x[k]
        x[i] /= factor[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= factor[k, i] * x[k]
        x[i] /= factor[i, i]
