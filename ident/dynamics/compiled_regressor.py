"""The regressor H of (6) in compiled form."""

import numpy as np

from ident.dynamics.compiled_chain import move, place, workspace
from ident.dynamics.vectors import add, cross, dot, row, sub, turned_back
from wamctl.arm.compilation import compiled


@compiled
def _write(out, column, z, lever, force, moment):
    out[column] = dot(z, moment) + dot(lever, force)


@compiled
def _link_row(out, z, lever, omega, alpha, a):
    """Torque about axis z per unit of each of a link's parameters; vectors in the link's frame."""
    none = (0.0, 0.0, 0.0)
    column = 0
    for r in range(3):
        for c in range(r, 3):
            # image of u under the unit tensor with ones at (r, c) and (c, r)
            zr, zc = z[r], z[c]
            spin = cross(z, omega)
            value = zr * alpha[c] + spin[r] * omega[c]
            if r != c:
                value += zc * alpha[r] + spin[c] * omega[r]
            out[column] = value
            column += 1
    for c in range(3):
        e = (1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0)
        force = add(cross(alpha, e), cross(omega, cross(omega, e)))
        _write(out, 6 + c, z, lever, force, cross(e, a))
    _write(out, 9, z, lever, a, none)


@compiled
def regressor(chain, q, qd, qdd):
    """Regressor H of (6) of S samples, shape (S, n, 10 n)."""
    samples, n = q.shape
    h = np.zeros((samples, n, 10 * n))
    w = workspace(n)
    for s in range(samples):
        place(chain, q[s], w)
        move(chain, qd[s], qdd[s], w)
        for k in range(n):
            omega = turned_back(w.link_rotation, k, row(w.omega, k))
            alpha = turned_back(w.link_rotation, k, row(w.alpha, k))
            a = turned_back(w.link_rotation, k, row(w.accel, k))
            for i in range(k + 1):
                axis = row(w.axis, i)
                out = h[s, i, 10 * k : 10 * k + 10]
                z = turned_back(w.link_rotation, k, axis)
                if chain.sliding[i]:
                    _link_row(out, (0.0, 0.0, 0.0), z, omega, alpha, a)
                else:
                    reach = sub(row(w.link_origin, k), row(w.origin, i))
                    lever = turned_back(w.link_rotation, k, cross(axis, reach))
                    _link_row(out, z, lever, omega, alpha, a)
    return h
