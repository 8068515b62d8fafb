"""Rigid-body dynamics of a serial chain in compiled form: minutes of motion in seconds.

Poses and motions are expressed in the base frame; forces are summed over the links about the base
frame's origin (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5.3 and 6.2).
Parameters are those of the paper's (8), in the robot's parameter frames.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.vectors import (
    add,
    cross,
    dot,
    row,
    scale,
    store,
    sub,
    symmetric,
    turned,
    turned_back,
)
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled
from wamctl.arm.robot import Robot


class Chain(NamedTuple):
    """Kinematics of n joints as plain arrays.

    Attributes:
        rotation: each joint frame's orientation in its parent at q = 0, shape (n, 3, 3).
        offset: each joint frame's origin in its parent [m], shape (n, 3).
        axis: joint axis in the joint's frame, shape (n, 3).
        sliding: True for prismatic joints, False for revolute ones, shape (n,).
        link_rotation: each parameter frame's orientation in its joint frame, shape (n, 3, 3).
        link_offset: each parameter frame's origin in its joint frame [m], shape (n, 3).
        gravity: in the base frame [m/s^2], shape (3,).
    """

    rotation: Array
    offset: Array
    axis: Array
    sliding: NDArray[np.bool_]
    link_rotation: Array
    link_offset: Array
    gravity: Array


class Pose(NamedTuple):
    """Where the joints and links are, in the base frame; a workspace that `place` fills."""

    joint_rotation: Array
    origin: Array
    axis: Array
    link_rotation: Array
    link_origin: Array
    omega: Array
    alpha: Array
    accel: Array


def chain_of(robot: Robot) -> Chain:
    """The kinematics and gravity of a robot."""
    joints = range(1, robot.dof + 1)
    placements = [robot.model.jointPlacements[k] for k in joints]
    sliding, subspaces = robot.sliding, robot.motion_subspaces
    axes = np.where(sliding[:, None], subspaces[:, :3], subspaces[:, 3:])
    links = np.array(robot.parameter_placements)
    return Chain(
        np.array([p.rotation for p in placements]),
        np.array([p.translation for p in placements]),
        axes,
        sliding,
        np.ascontiguousarray(links[:, :3, :3]),
        np.ascontiguousarray(links[:, :3, 3]),
        np.array(robot.model.gravity.linear, dtype=float),
    )


@compiled
def workspace(n):
    """An empty `Pose` for n joints."""
    m, v = (n, 3, 3), (n, 3)
    return Pose(
        np.empty(m), np.empty(v), np.empty(v), np.empty(m), np.empty(v), np.empty(v), np.empty(v),
        np.empty(v),
    )  # fmt: skip


@compiled
def _product(a, i, b, j, out, k):
    for r in range(3):
        for c in range(3):
            out[k, r, c] = (
                a[i, r, 0] * b[j, 0, c] + a[i, r, 1] * b[j, 1, c] + a[i, r, 2] * b[j, 2, c]
            )


@compiled
def _turn_about(m, k, axis, angle):
    """Multiply the rotation m[k] from the right by a turn about a unit axis (Rodrigues)."""
    c, s = np.cos(angle), np.sin(angle)
    for r in range(3):
        v = (m[k, r, 0], m[k, r, 1], m[k, r, 2])
        side = cross(v, axis)
        along = (1.0 - c) * dot(v, axis)
        for i in range(3):
            m[k, r, i] = c * v[i] + s * side[i] + along * axis[i]


@compiled
def place(chain, q, w):
    """Fill the poses of workspace `w` for joint positions q [rad], shape (n,)."""
    for k in range(q.size):
        if k == 0:
            p = row(chain.offset, 0)
            for r in range(3):
                store(w.joint_rotation[0], r, row(chain.rotation[0], r))
        else:
            p = add(row(w.origin, k - 1), turned(w.joint_rotation, k - 1, row(chain.offset, k)))
            _product(w.joint_rotation, k - 1, chain.rotation, k, w.joint_rotation, k)
        z = turned(w.joint_rotation, k, row(chain.axis, k))
        if chain.sliding[k]:
            p = add(p, scale(q[k], z))
        else:
            _turn_about(w.joint_rotation, k, row(chain.axis, k), q[k])
        store(w.axis, k, z)
        store(w.origin, k, p)
        _product(w.joint_rotation, k, chain.link_rotation, k, w.link_rotation, k)
        reach = turned(w.joint_rotation, k, row(chain.link_offset, k))
        store(w.link_origin, k, add(p, reach))


@compiled
def move(chain, qd, qdd, w):
    """Fill the links' angular velocity and acceleration, and origins' acceleration less gravity."""
    omega, alpha, last = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    a = (-chain.gravity[0], -chain.gravity[1], -chain.gravity[2])
    for k in range(qd.size):
        here, z = row(w.origin, k), row(w.axis, k)
        arm = sub(here, last)
        a = add(a, add(cross(alpha, arm), cross(omega, cross(omega, arm))))
        if chain.sliding[k]:
            a = add(a, add(scale(qdd[k], z), scale(2.0 * qd[k], cross(omega, z))))
        else:
            alpha = add(alpha, add(scale(qdd[k], z), scale(qd[k], cross(omega, z))))
            omega = add(omega, scale(qd[k], z))
        last = here
        reach = sub(row(w.link_origin, k), here)
        store(w.omega, k, omega)
        store(w.alpha, k, alpha)
        store(w.accel, k, add(a, add(cross(alpha, reach), cross(omega, cross(omega, reach)))))


@compiled
def inverse_dynamics(chain, delta, q, qd, qdd, w, tau):
    """Write the torque of (1) [N m] for one sample into `tau`, shape (n,).

    Args:
        chain: kinematics and gravity.
        delta: inertial parameters in the order of (8), shape (10 n,).
        q: joint position [rad], shape (n,).
        qd: velocity [rad/s], shape (n,).
        qdd: acceleration [rad/s^2], shape (n,).
        w: workspace.
        tau: result.
    """
    place(chain, q, w)
    move(chain, qd, qdd, w)
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(q.size - 1, -1, -1):
        i = 10 * k
        omega = turned_back(w.link_rotation, k, row(w.omega, k))
        alpha = turned_back(w.link_rotation, k, row(w.alpha, k))
        a = turned_back(w.link_rotation, k, row(w.accel, k))
        h = (delta[i + 6], delta[i + 7], delta[i + 8])
        f = add(scale(delta[i + 9], a), add(cross(alpha, h), cross(omega, cross(omega, h))))
        spin = cross(omega, symmetric(delta, i, omega))
        local = add(add(symmetric(delta, i, alpha), spin), cross(h, a))
        f = turned(w.link_rotation, k, f)
        force = add(force, f)
        local = turned(w.link_rotation, k, local)
        moment = add(moment, add(local, cross(row(w.link_origin, k), f)))
        z = row(w.axis, k)
        if chain.sliding[k]:
            tau[k] = dot(z, force)
        else:
            tau[k] = dot(z, sub(moment, cross(row(w.origin, k), force)))


@compiled
def mass_matrix(chain, delta, w, out):
    """Write M(q) of (1), shape (n, n), for the pose in `w`, by composite inertias."""
    mass, first = 0.0, (0.0, 0.0, 0.0)
    tensor = np.zeros((3, 3))
    for k in range(out.shape[0] - 1, -1, -1):
        i = 10 * k
        m, p = delta[i + 9], row(w.link_origin, k)
        h = turned(w.link_rotation, k, (delta[i + 6], delta[i + 7], delta[i + 8]))
        for c in range(3):
            e = (1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0)
            about = symmetric(delta, i, turned_back(w.link_rotation, k, e))
            about = turned(w.link_rotation, k, about)
            pe = cross(p, e)
            shift = add(cross(p, cross(h, e)), cross(add(h, scale(m, p)), pe))
            for r in range(3):
                tensor[r, c] += about[r] - shift[r]
        mass += m
        first = add(first, add(h, scale(m, p)))
        _column(chain, w, k, mass, first, tensor, out)


@compiled
def _column(chain, w, k, mass, first, tensor, out):
    """Column k of M above the diagonal: the forces that move the links from k outwards."""
    z = row(w.axis, k)
    if chain.sliding[k]:
        force, moment = scale(mass, z), cross(first, z)
    else:
        v = cross(row(w.origin, k), z)
        force = sub(scale(mass, v), cross(first, z))
        spun = (
            tensor[0, 0] * z[0] + tensor[0, 1] * z[1] + tensor[0, 2] * z[2],
            tensor[1, 0] * z[0] + tensor[1, 1] * z[1] + tensor[1, 2] * z[2],
            tensor[2, 0] * z[0] + tensor[2, 1] * z[1] + tensor[2, 2] * z[2],
        )
        moment = add(spun, cross(first, v))
    for i in range(k + 1):
        if chain.sliding[i]:
            out[i, k] = dot(row(w.axis, i), force)
        else:
            out[i, k] = dot(row(w.axis, i), sub(moment, cross(row(w.origin, i), force)))
        out[k, i] = out[i, k]


@compiled
def torques(chain, delta, q, qd, qdd):
    """Torque of (1) [N m] of S samples, shape (S, n)."""
    tau = np.empty_like(q)
    w = workspace(q.shape[1])
    for s in range(q.shape[0]):
        inverse_dynamics(chain, delta, q[s], qd[s], qdd[s], w, tau[s])
    return tau


@compiled
def weights(chain, delta, q):
    """Torque that holds the links at rest, per unit of gravity along each base axis [kg m].

    Of S samples, shape (S, n, 3); it does not depend on the chain's own gravity.
    """
    samples, n = q.shape
    found = np.empty((samples, n, 3))
    w = workspace(n)
    for s in range(samples):
        place(chain, q[s], w)
        mass, first = 0.0, (0.0, 0.0, 0.0)
        for k in range(n - 1, -1, -1):
            i = 10 * k
            h = turned(w.link_rotation, k, (delta[i + 6], delta[i + 7], delta[i + 8]))
            mass += delta[i + 9]
            first = add(first, add(h, scale(delta[i + 9], row(w.link_origin, k))))
            z = row(w.axis, k)
            if chain.sliding[k]:
                store(found[s], k, scale(-mass, z))
            else:
                store(found[s], k, cross(sub(first, scale(mass, row(w.origin, k))), z))
    return found


@compiled
def invert(matrix, out):
    """Inverse of a positive definite matrix by Gauss-Jordan steps; the matrix is used up."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for i in range(n):
        pivot = 1.0 / matrix[i, i]
        for c in range(n):
            matrix[i, c] *= pivot
            out[i, c] *= pivot
        for r in range(n):
            factor = matrix[r, i]
            if r != i and factor != 0.0:
                for c in range(n):
                    matrix[r, c] -= factor * matrix[i, c]
                    out[r, c] -= factor * out[i, c]
