"""Speed of points of the arm and distance of its shapes, with gradients, compiled.

Every shape is a box with rounded edges: a capsule is a box without width, a sphere a box without
size. The distance of a capsule's axis from a box is convex along the axis: where its slope changes
sign, it is least.
"""

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import place, workspace
from ident.dynamics.vectors import add, cross, dot, row, scale, sub, turned, turned_back
from ident.signals.arrays import Array
from wamctl.arm.collision import CollisionShapes
from wamctl.arm.compilation import compiled
from wamctl.arm.robot import Robot

_STEPS = 20
_LEVEL = 1e-7


class Points(NamedTuple):
    """Points fixed to links.

    Attributes:
        link: the joint, from 0, that carries each of the P points.
        position: in that joint's frame, shape (P, 3) [m].
    """

    link: NDArray[np.int64]
    position: Array


class Shapes(NamedTuple):
    """Rounded boxes fixed to links, and the pairs to watch.

    Attributes:
        link: the joint, from 0, that carries each shape; -1 for the base.
        rotation, position: each shape in its joint's frame, shapes (B, 3, 3) and (B, 3).
        half: half lengths of the box, shape (B, 3) [m].
        radius: of the rounding, shape (B,) [m].
        outer: radius of the sphere around each shape, shape (B,) [m].
        pairs: places of capsule and other shape, shape (P, 2).
    """

    link: NDArray[np.int64]
    rotation: Array
    position: Array
    half: Array
    radius: Array
    outer: Array
    pairs: NDArray[np.int64]


def points_of(robot: Robot, frames: tuple[str, ...]) -> Points:
    """The origins of URDF frames."""
    found = [robot.model.frames[robot.model.getFrameId(name)] for name in frames]
    links = np.array([frame.parentJoint - 1 for frame in found])
    return Points(links, np.array([frame.placement.translation for frame in found]))


def shapes_of(collision: CollisionShapes) -> Shapes:
    """The shapes as rounded boxes; what is neither box, capsule nor sphere is enclosed."""
    objects = list(collision.geometry.geometryObjects)
    sizes = [_size(o.geometry) for o in objects]
    pairs = [(p.first, p.second) for p in collision.geometry.collisionPairs]
    ordered = [(a, b) if _thin(sizes[a]) else (b, a) for a, b in pairs]
    watched = [pair for pair in ordered if _thin(sizes[pair[0]])]
    return Shapes(
        np.array([o.parentJoint - 1 for o in objects], dtype=np.int64),
        np.array([o.placement.rotation for o in objects]).reshape(-1, 3, 3),
        np.array([o.placement.translation for o in objects]).reshape(-1, 3),
        np.array([half for half, _ in sizes]).reshape(-1, 3),
        np.array([radius for _, radius in sizes]),
        np.array([np.linalg.norm(half) + radius for half, radius in sizes]),
        np.array(watched, dtype=np.int64).reshape(-1, 2),
    )


def _size(shape: pin.coal.CollisionGeometry) -> tuple[tuple[float, float, float], float]:
    """Half lengths and rounding [m]."""
    match type(shape).__name__:
        case "Capsule" | "Cylinder":
            return (0.0, 0.0, shape.halfLength), shape.radius
        case "Sphere":
            return (0.0, 0.0, 0.0), shape.radius
        case "Box":
            return tuple(shape.halfSide), 0.0
        case _:
            shape.computeLocalAABB()
            return (0.0, 0.0, 0.0), shape.aabb_radius


def _thin(size: tuple[tuple[float, float, float], float]) -> bool:
    return size[0][0] == 0.0 and size[0][1] == 0.0


@compiled
def point_speeds(chain, points, q, qd, squares):
    """Write the squared speed [m^2/s^2] of each point into `squares`, shape (S, P)."""
    if points.link.size == 0:
        return
    w = workspace(q.shape[1])
    for s in range(q.shape[0]):
        place(chain, q[s], w)
        for p in range(points.link.size):
            v = _velocity(w, points, p, qd[s])
            squares[s, p] = dot(v, v)


@compiled
def _velocity(w, points, p, qd):
    link = points.link[p]
    at = add(row(w.origin, link), turned(w.joint_rotation, link, row(points.position, p)))
    v = (0.0, 0.0, 0.0)
    for j in range(link + 1):
        v = add(v, scale(qd[j], cross(row(w.axis, j), sub(at, row(w.origin, j)))))
    return v


@compiled
def speeds_vjp(chain, points, q, qd, bar, grad_q, grad_qd):
    """Add the gradient of sum(bar * squares) to `grad_q` and `grad_qd`, each of shape (S, n)."""
    if points.link.size == 0:
        return
    w = workspace(q.shape[1])
    for s in range(q.shape[0]):
        place(chain, q[s], w)
        for p in range(points.link.size):
            if bar[s, p] == 0.0:
                continue
            link = points.link[p]
            at = add(row(w.origin, link), turned(w.joint_rotation, link, row(points.position, p)))
            v = _velocity(w, points, p, qd[s])
            beyond, spin = v, (0.0, 0.0, 0.0)
            for m in range(link + 1):
                z = row(w.axis, m)
                lever = cross(z, sub(at, row(w.origin, m)))
                spin = add(spin, scale(qd[s, m], z))
                beyond = sub(beyond, scale(qd[s, m], lever))
                change = add(cross(spin, lever), cross(z, beyond))
                grad_q[s, m] += 2.0 * bar[s, p] * dot(v, change)
                grad_qd[s, m] += 2.0 * bar[s, p] * dot(v, lever)


@compiled
def _centre(w, shapes, b):
    """Centre of a shape in the base frame."""
    link = shapes.link[b]
    if link < 0:
        return row(shapes.position, b)
    return add(row(w.origin, link), turned(w.joint_rotation, link, row(shapes.position, b)))


@compiled
def _outwards(w, shapes, b, v):
    """A vector of a shape's frame in the base frame."""
    v = turned(shapes.rotation, b, v)
    return turned(w.joint_rotation, shapes.link[b], v) if shapes.link[b] >= 0 else v


@compiled
def _inwards(w, shapes, b, v):
    """A vector of the base frame in a shape's frame."""
    if shapes.link[b] >= 0:
        v = turned_back(w.joint_rotation, shapes.link[b], v)
    return turned_back(shapes.rotation, b, v)


@compiled
def _box_distance(half, b, p):
    """Signed distance of a point from a box, and its gradient by the point."""
    x, y, z = abs(p[0]) - half[b, 0], abs(p[1]) - half[b, 1], abs(p[2]) - half[b, 2]
    sign = (
        1.0 if p[0] > 0.0 else -1.0,
        1.0 if p[1] > 0.0 else -1.0,
        1.0 if p[2] > 0.0 else -1.0,
    )
    if x <= 0.0 and y <= 0.0 and z <= 0.0:
        if x >= y and x >= z:
            return x, (sign[0], 0.0, 0.0)
        if y >= z:
            return y, (0.0, sign[1], 0.0)
        return z, (0.0, 0.0, sign[2])
    x, y, z = max(x, 0.0), max(y, 0.0), max(z, 0.0)
    d = np.sqrt(x * x + y * y + z * z)
    return d, (sign[0] * x / d, sign[1] * y / d, sign[2] * z / d)


@compiled
def _slope(half, b, centre, axis, along):
    """How the distance from a box changes along an axis."""
    return dot(_box_distance(half, b, add(centre, scale(along, axis)))[1], axis)


@compiled
def _lowest(half, b, centre, axis):
    """Where between -1 and 1 the axis is nearest to the box, by the Illinois rule."""
    low, high = -1.0, 1.0
    below = _slope(half, b, centre, axis, low)
    if below >= 0.0:
        return low
    above = _slope(half, b, centre, axis, high)
    if above <= 0.0:
        return high
    side = 0
    for _ in range(_STEPS):
        middle = (low * above - high * below) / (above - below)
        slope = _slope(half, b, centre, axis, middle)
        if abs(slope) < _LEVEL:
            return middle
        if slope > 0.0:
            high, above = middle, slope
            below = 0.5 * below if side == 1 else below
            side = 1
        else:
            low, below = middle, slope
            above = 0.5 * above if side == -1 else above
            side = -1
    return 0.5 * (low + high)


@compiled
def _nearest(w, shapes, a, b):
    """Distance of capsule a from shape b, the direction away from b, and the point on a's axis."""
    centre = _inwards(w, shapes, b, sub(_centre(w, shapes, a), _centre(w, shapes, b)))
    axis = _inwards(w, shapes, b, _outwards(w, shapes, a, (0.0, 0.0, shapes.half[a, 2])))
    at = add(centre, scale(_lowest(shapes.half, b, centre, axis), axis))
    d, gradient = _box_distance(shapes.half, b, at)
    away = _outwards(w, shapes, b, gradient)
    point = add(_centre(w, shapes, b), _outwards(w, shapes, b, at))
    return d - shapes.radius[a] - shapes.radius[b], away, point


@compiled
def _far(w, shapes, a, b, reach):
    """Whether two shapes are surely further apart than `reach`; by spheres, then closer."""
    gap = sub(_centre(w, shapes, a), _centre(w, shapes, b))
    around = shapes.outer[a] + shapes.outer[b] + reach
    if dot(gap, gap) > around * around:
        return True
    centre = _inwards(w, shapes, b, gap)
    size = shapes.half[a, 2] + shapes.radius[a] + shapes.radius[b]
    return _box_distance(shapes.half, b, centre)[0] - size > reach


@compiled
def distances(chain, shapes, q, reach, out):
    """Write the distance of each pair [m], `reach` at most, into `out`, shape (S, P)."""
    if len(shapes.pairs) == 0:
        return
    w = workspace(q.shape[1])
    for s in range(q.shape[0]):
        place(chain, q[s], w)
        for p in range(len(shapes.pairs)):
            a, b = shapes.pairs[p]
            out[s, p] = reach
            if not _far(w, shapes, a, b, reach):
                out[s, p] = min(reach, _nearest(w, shapes, a, b)[0])


@compiled
def distances_vjp(chain, shapes, q, bar, grad_q):
    """Add the gradient of sum(bar * distances) to `grad_q`, shape (S, n)."""
    if len(shapes.pairs) == 0:
        return
    w = workspace(q.shape[1])
    for s in range(q.shape[0]):
        place(chain, q[s], w)
        for p in range(len(shapes.pairs)):
            if bar[s, p] == 0.0:
                continue
            a, b = shapes.pairs[p]
            _, away, point = _nearest(w, shapes, a, b)
            for side in range(2):
                weight = bar[s, p] if side == 0 else -bar[s, p]
                for m in range(shapes.link[a if side == 0 else b] + 1):
                    lever = cross(row(w.axis, m), sub(point, row(w.origin, m)))
                    grad_q[s, m] += weight * dot(away, lever)
