"""The regressor's inertial columns of a chain and the gradient of anything made of them, compiled.

Newton and Euler outwards from link to link, in the frames of the parameters (8); a joint's torque
is the power of a link's inertial force along the joint's screw. `regressor_vjp` is the exact
reverse of `fill_rows`: the change of sum(bar * rows) with position, velocity and acceleration.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of
from ident.dynamics.vectors import (
    add,
    cross,
    dot,
    row,
    scale,
    store,
    symmetric,
    turned,
    turned_back,
)
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import Robot


class Frames(NamedTuple):
    """The chain from parameter frame to parameter frame.

    Attributes:
        rotation: each frame's orientation in the one before it at q = 0, shape (n, 3, 3).
        axis: joint axis in the frame, shape (n, 3).
        inner: the joint's origin in the frame before it [m], shape (n, 3).
        outer: the frame's origin from the joint's, in the frame [m], shape (n, 3).
        gravity: in the base frame [m/s^2], shape (3,).
        column: place of each of the 10 n inertial parameters in the wanted columns, or -1.
    """

    rotation: Array
    axis: Array
    inner: Array
    outer: Array
    gravity: Array
    column: NDArray[np.int64]


class State(NamedTuple):
    """Motion of the links of one sample, or its adjoint; a workspace.

    Attributes:
        rotation: each frame in the one before it, shape (n, 3, 3).
        omega, alpha, accel: angular velocity, angular acceleration, and acceleration less gravity
            of each frame's origin, in the frame, shape (n, 3).
        turn, shift: screw of joint i at the origin of frame k, in that frame, shape (k, i, 3).
    """

    rotation: Array
    omega: Array
    alpha: Array
    accel: Array
    turn: Array
    shift: Array


def frames_of(robot: Robot, columns: NDArray[np.int64]) -> Frames:
    """The frames of a robot, for the wanted inertial columns.

    Args:
        robot: kinematics, gravity, and parameter frames.
        columns: wanted entries of (8), ascending.

    Raises:
        ConfigurationError: a sliding joint, which the excitation does not know.
    """
    chain = chain_of(robot)
    if chain.sliding.any():
        names = ", ".join(np.array(robot.joint_names)[chain.sliding])
        raise ConfigurationError(
            "URDF", [f"{names} slides; the excitation knows turning joints only"]
        )
    rotation, inner = [], []
    turned_before, moved_before = np.eye(3), np.zeros(3)
    for k in range(robot.dof):
        rotation.append(turned_before.T @ chain.rotation[k] @ chain.link_rotation[k])
        inner.append(turned_before.T @ (chain.offset[k] - moved_before))
        turned_before, moved_before = chain.link_rotation[k], chain.link_offset[k]
    back = np.swapaxes(chain.link_rotation, 1, 2)
    axis = np.einsum("kij,kj->ki", back, chain.axis)
    outer = np.einsum("kij,kj->ki", back, chain.link_offset)
    column = np.full(10 * robot.dof, -1)
    column[columns] = np.arange(len(columns))
    return Frames(np.array(rotation), axis, np.array(inner), outer, chain.gravity, column)


@compiled
def _state(n):
    v, s = (n, 3), (n, n, 3)
    return State(
        np.empty((n, 3, 3)), np.zeros(v), np.zeros(v), np.zeros(v), np.zeros(s), np.zeros(s)
    )


@compiled
def _turn(frames, k, angle, out):
    c, s, n = np.cos(angle), np.sin(angle), row(frames.axis, k)
    for r in range(3):
        v = row(frames.rotation[k], r)
        along = scale((1.0 - c) * dot(v, n), n)
        store(out[k], r, add(add(scale(c, v), scale(s, cross(v, n))), along))


@compiled
def _move(frames, q, qd, qdd, x):
    """Fill the state of one sample, outwards."""
    for k in range(q.size):
        _turn(frames, k, q[k], x.rotation)
        z, p, r = row(frames.axis, k), row(frames.inner, k), row(frames.outer, k)
        g = frames.gravity
        o, a, t = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (-g[0], -g[1], -g[2])
        if k > 0:
            o, a = row(x.omega, k - 1), row(x.alpha, k - 1)
            t = add(row(x.accel, k - 1), add(cross(a, p), cross(o, cross(o, p))))
        o = add(turned_back(x.rotation, k, o), scale(qd[k], z))
        a = add(turned_back(x.rotation, k, a), add(scale(qdd[k], z), scale(qd[k], cross(o, z))))
        t = add(turned_back(x.rotation, k, t), add(cross(a, r), cross(o, cross(o, r))))
        store(x.omega, k, o)
        store(x.alpha, k, a)
        store(x.accel, k, t)
        for i in range(k):
            w = row(x.turn[k - 1], i)
            u = turned_back(x.rotation, k, add(row(x.shift[k - 1], i), cross(w, p)))
            w = turned_back(x.rotation, k, w)
            store(x.turn[k], i, w)
            store(x.shift[k], i, add(u, cross(w, r)))
        store(x.turn[k], k, z)
        store(x.shift[k], k, cross(z, r))


@compiled
def fill_rows(frames, q, qd, qdd, out):
    """Write the wanted inertial columns [N m per unit] of S samples into `out`, shape (n, S, m).

    Args:
        frames: kinematics, gravity, and wanted columns.
        q: position, shape (S, n) [rad].
        qd: velocity, shape (S, n) [rad/s].
        qdd: acceleration, shape (S, n) [rad/s^2].
        out: result, whose first columns are the inertial ones; zero where nothing is written.
    """
    n = q.shape[1]
    x = _state(n)
    y = np.empty(10)
    for s in range(q.shape[0]):
        _move(frames, q[s], qd[s], qdd[s], x)
        for k in range(n):
            o, a, g = row(x.omega, k), row(x.alpha, k), row(x.accel, k)
            for i in range(k + 1):
                w, u = row(x.turn[k], i), row(x.shift[k], i)
                c = cross(w, o)
                y[0] = w[0] * a[0] + c[0] * o[0]
                y[1] = w[0] * a[1] + w[1] * a[0] + c[0] * o[1] + c[1] * o[0]
                y[2] = w[0] * a[2] + w[2] * a[0] + c[0] * o[2] + c[2] * o[0]
                y[3] = w[1] * a[1] + c[1] * o[1]
                y[4] = w[1] * a[2] + w[2] * a[1] + c[1] * o[2] + c[2] * o[1]
                y[5] = w[2] * a[2] + c[2] * o[2]
                h = add(add(cross(u, a), cross(cross(u, o), o)), cross(g, w))
                y[6], y[7], y[8] = h
                y[9] = dot(u, g)
                for j in range(10):
                    if frames.column[10 * k + j] >= 0:
                        out[i, s, frames.column[10 * k + j]] = y[j]


@compiled
def _accumulate(matrix, i, a):
    matrix[i, 0] += a[0]
    matrix[i, 1] += a[1]
    matrix[i, 2] += a[2]


@compiled
def _pull_link(x, bar, k, i, b):
    """Add to the adjoint what the block `b` of ten columns says of joint i's torque from link k."""
    o, a, g = row(x.omega, k), row(x.alpha, k), row(x.accel, k)
    w, u, h = row(x.turn[k], i), row(x.shift[k], i), (b[6], b[7], b[8])
    c, e = cross(w, o), cross(u, o)
    c_bar, e_bar = symmetric(b, 0, o), cross(o, h)
    _accumulate(bar.turn[k], i, add(add(symmetric(b, 0, a), cross(o, c_bar)), cross(h, g)))
    _accumulate(bar.shift[k], i, add(add(cross(a, h), cross(o, e_bar)), scale(b[9], g)))
    _accumulate(bar.alpha, k, add(symmetric(b, 0, w), cross(h, u)))
    spin = add(add(symmetric(b, 0, c), cross(c_bar, w)), add(cross(h, e), cross(e_bar, u)))
    _accumulate(bar.omega, k, spin)
    _accumulate(bar.accel, k, add(cross(w, h), scale(b[9], u)))


@compiled
def _pull_rotating(bar, k, o, r, t_bar):
    """Add to the adjoint of frame k what t = alpha x r + omega x (omega x r) says of it."""
    _accumulate(bar.alpha, k, cross(r, t_bar))
    f = cross(o, r)
    f_bar = cross(t_bar, o)
    _accumulate(bar.omega, k, add(cross(f, t_bar), cross(r, f_bar)))


@compiled
def _pull_joint(frames, x, bar, k, qd, out):
    """Carry the adjoint of frame k over joint k to the frame before it; gradient of q, qd, qdd."""
    z, p, r = row(frames.axis, k), row(frames.inner, k), row(frames.outer, k)
    o, t_bar = row(x.omega, k), row(bar.accel, k)
    _pull_rotating(bar, k, o, r, t_bar)
    a_bar = row(bar.alpha, k)
    _accumulate(bar.omega, k, scale(qd, cross(z, a_bar)))
    o_bar = row(bar.omega, k)
    t = add(row(x.accel, k), scale(-1.0, add(cross(row(x.alpha, k), r), cross(o, cross(o, r)))))
    out[0] = dot(t_bar, cross(t, z))
    out[1] = dot(a_bar, cross(o, z)) + dot(o_bar, z)
    out[2] = dot(a_bar, z)
    for i in range(k):
        w, u_bar = row(x.turn[k], i), row(bar.shift[k], i)
        u = add(row(x.shift[k], i), cross(r, w))
        w_bar = add(row(bar.turn[k], i), cross(r, u_bar))
        out[0] += dot(w_bar, cross(w, z)) + dot(u_bar, cross(u, z))
        u_bar = turned(x.rotation, k, u_bar)
        _accumulate(bar.shift[k - 1], i, u_bar)
        _accumulate(bar.turn[k - 1], i, add(turned(x.rotation, k, w_bar), cross(p, u_bar)))
    if k > 0:
        before = row(x.omega, k - 1)
        out[0] += dot(a_bar, cross(turned_back(x.rotation, k, row(x.alpha, k - 1)), z))
        out[0] += dot(o_bar, cross(turned_back(x.rotation, k, before), z))
        t_bar = turned(x.rotation, k, t_bar)
        _accumulate(bar.accel, k - 1, t_bar)
        _accumulate(bar.alpha, k - 1, turned(x.rotation, k, a_bar))
        _accumulate(bar.omega, k - 1, turned(x.rotation, k, o_bar))
        _pull_rotating(bar, k - 1, before, p, t_bar)


@compiled
def regressor_vjp(frames, q, qd, qdd, bar_rows, grad_q, grad_qd, grad_qdd):
    """Add the gradient of sum(bar_rows * rows) to the three gradients, each of shape (S, n).

    Args:
        frames: kinematics, gravity, and wanted columns.
        q: position, shape (S, n) [rad].
        qd: velocity, shape (S, n) [rad/s].
        qdd: acceleration, shape (S, n) [rad/s^2].
        bar_rows: shape (n, S, m), as `fill_rows` writes.
        grad_q: gradient by position, shape (S, n).
        grad_qd: gradient by velocity, shape (S, n).
        grad_qdd: gradient by acceleration, shape (S, n).
    """
    n = q.shape[1]
    x, bar = _state(n), _state(n)
    block, out = np.zeros(10), np.empty(3)
    for s in range(q.shape[0]):
        _move(frames, q[s], qd[s], qdd[s], x)
        for part in (bar.omega, bar.alpha, bar.accel):
            part[:] = 0.0
        for part in (bar.turn, bar.shift):
            part[:] = 0.0
        for k in range(n - 1, -1, -1):
            for i in range(k + 1):
                for j in range(10):
                    place = frames.column[10 * k + j]
                    block[j] = bar_rows[i, s, place] if place >= 0 else 0.0
                _pull_link(x, bar, k, i, block)
            _pull_joint(frames, x, bar, k, qd[s, k], out)
            grad_q[s, k] += out[0]
            grad_qd[s, k] += out[1]
            grad_qdd[s, k] += out[2]
