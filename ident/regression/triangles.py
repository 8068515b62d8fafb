"""Triangles of rows: the least squares of (15) by QR (32)-(35), and its solution (16).

The triangle R of [W | tau] holds all that least squares ever asks of the rows: normal equations,
residuals, and their condition. Triangles of parts merge into the triangle of the whole.
"""

import numpy as np

from ident.signals.arrays import Array


def triangle(rows: Array) -> Array:
    """A square matrix R with R^T R = rows^T rows, by QR decomposition (32), shape (c, c).

    Columns that are zero throughout (a joint feels only the links beyond it) cost nothing; they
    stay zero, and R is triangular in the others.
    """
    used = np.flatnonzero(np.any(rows != 0, axis=0))
    r = np.asarray(np.linalg.qr(rows[:, used], mode="r"))
    result = np.zeros((rows.shape[1], rows.shape[1]))
    result[: len(r), used] = r
    return result


def merged(triangles: Array) -> Array:
    """The triangle of all rows behind several triangles, shape (c, c).

    Args:
        triangles: shape (..., c, c).
    """
    return triangle(triangles.reshape(-1, triangles.shape[-1]))


def squared_error(triangles: Array, beta: Array) -> Array:
    """||tau - W beta||^2 [N^2 m^2] of each triangle, shape (...).

    Args:
        triangles: shape (..., b + 1, b + 1).
        beta: shape (b,).
    """
    return np.sum((triangles @ np.append(-beta, 1.0)) ** 2, axis=-1)


def squared_torque(triangles: Array) -> Array:
    """||tau||^2 [N^2 m^2] of each triangle, shape (...)."""
    return np.sum(triangles[..., -1] ** 2, axis=-1)


def least_squares(R: Array) -> Array:
    """OLS (16), shape (b,): the triangle solved with its columns in their own scale.

    Raises:
        LinAlgError: a base parameter that these rows leave free.
    """
    R1, rho1 = R[:-1, :-1], R[:-1, -1]
    scale = np.linalg.norm(R1, axis=0)
    if (scale == 0).any():
        raise np.linalg.LinAlgError("Some base parameters have no effect in these rows.")
    return np.linalg.solve(R1 / scale, rho1) / scale


def condition_number(R: Array) -> float:
    """Ratio of the largest and smallest singular value of W (paper, V-A)."""
    return float(np.linalg.cond(R[:-1, :-1]))
