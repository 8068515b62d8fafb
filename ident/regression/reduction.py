"""Rows reduced to triangles: QR (32)-(35), the least squares of (15), and its solution (16).

The triangle R of [W | tau] holds all that least squares ever asks of the rows: normal equations,
residuals, and their condition. Triangles of parts merge into the triangle of the whole, so that W
is never held.
"""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.regression.rows import Rows
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]
K = TypeVar("K", int, tuple[int, int])

BLOCKS = 36
"""Equal stretches into which each recording is cut, for held-out checks and error bars."""


EXCERPT = 4000
"""Most instants that an excerpt holds."""


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


@dataclass(frozen=True)
class Subsample:
    """Single rows, evenly thinned: for figures, and for what no triangle can tell.

    Attributes:
        t: time since the recording's first sample [s], shape (E,).
        speed: velocity [rad/s], shape (E, n); zero for held joints.
        kept: which rows entered the fit, shape (E, n).
        W: regressor, shape (E, n, b); zero for held joints.
        tau: torque [N m], shape (E, n).
        tau_rate: its derivative [N m/s], shape (E, n).
    """

    t: Array
    speed: Array
    kept: NDArray[np.bool_]
    W: Array
    tau: Array
    tau_rate: Array

    def rows(self, *more: Array) -> list[Array]:
        """Per joint the rows [more | W | tau] that entered the fit; empty for held joints.

        Args:
            more: further columns, each of shape (E, n).
        """
        return [
            np.column_stack([*(m[k, j] for m in more), self.W[k, j], self.tau[k, j]])
            for j, k in enumerate(self.kept.T)
        ]


@dataclass(frozen=True)
class Reduction:
    """One recording, reduced.

    Attributes:
        R: triangles of [W | tau] per stretch and joint, shape (blocks, n, b + 1, b + 1); zero for
            held joints.
        R_raw: triangles of the unfiltered rows, shape (n, b + 1, b + 1).
        count: number of rows in each, shape (blocks, n).
        culled: number of rows left out because the joint was too slow, shape (n,).
        span_s: begin and end of the rows [s], which the stretches share equally.
        excerpt: some of the rows, culled ones included.
        regressor_s: time that forming the regressor took [s].
    """

    R: Array
    R_raw: Array
    count: NDArray[np.int64]
    culled: NDArray[np.int64]
    span_s: tuple[float, float]
    excerpt: Subsample
    regressor_s: float

    @property
    def culled_fraction(self) -> float:
        """Share of the rows that was left out."""
        culled = int(self.culled.sum())
        return culled / max(culled + int(self.count.sum()), 1)

    def only(self, stretches: NDArray[np.bool_]) -> "Reduction":
        """The same recording, with only some of its stretches, shape (BLOCKS,)."""
        inside = stretches[block_of(self.excerpt.t, self.span_s)]
        rows = {f.name: getattr(self.excerpt, f.name)[inside] for f in fields(Subsample)}
        keep = stretches[:, None]
        return replace(
            self,
            R=self.R * keep[..., None, None],
            count=self.count * keep,
            excerpt=Subsample(**rows),
        )


def block_of(t: Array, span_s: tuple[float, float]) -> NDArray[np.int64]:
    """The stretch that each instant belongs to."""
    share = (t - span_s[0]) / (span_s[1] - span_s[0])
    return np.clip((BLOCKS * share).astype(np.int64), 0, BLOCKS - 1)


def reduction(
    stream: Iterable[Rows],
    span_s: tuple[float, float],
    threshold_rad_s: float,
    moving: NDArray[np.bool_],
) -> Reduction:
    """The rows of one recording, reduced as they come.

    Args:
        stream: rows of the m moving joints, in order of time.
        span_s: begin and end of the rows [s].
        threshold_rad_s: rows of a slower joint are left out [rad/s].
        moving: which joints move, shape (n,).
    """
    joints = np.flatnonzero(moving)
    n = len(moving)
    culled = np.zeros(n, dtype=np.int64)
    parts: dict[tuple[int, int], Array] = {}
    raw: dict[int, Array] = {}
    count = np.zeros((BLOCKS, n), dtype=np.int64)
    excerpts: list[Subsample] = []
    stride, regressor_s = 1, 0.0
    for rows in stream:
        regressor_s += rows.regressor_s
        kept = np.abs(rows.speed) >= threshold_rad_s
        culled[joints] += (~kept).sum(axis=0)
        block = block_of(rows.t, span_s)
        for place, j in enumerate(joints):
            chosen = kept[:, place]
            _add(raw, int(j), rows.W_raw[chosen, place], rows.tau_raw[chosen, place])
            for b in np.unique(block):
                inside = chosen & (block == b)
                _add(parts, (int(b), int(j)), rows.W[inside, place], rows.tau[inside, place])
                count[b, j] += inside.sum()
        excerpts.append(_excerpt(rows, kept, stride, joints, n))
        while sum(len(e.t) for e in excerpts) > EXCERPT:
            stride *= 2
            excerpts = [_thinned(e) for e in excerpts]
        del rows  # the stream needs the room for the next ones
    excerpt = _joined(excerpts)
    size = excerpt.W.shape[-1] + 1
    R, R_raw = np.zeros((BLOCKS, n, size, size)), np.zeros((n, size, size))
    for place, part in (*parts.items(), *raw.items()):
        target = R if isinstance(place, tuple) else R_raw
        target[place] = part
    return Reduction(R, R_raw, count, culled, span_s, excerpt, regressor_s)


def _add(parts: dict[K, Array], key: K, W: Array, tau: Array) -> None:
    """Merge rows into the part of that key."""
    rows = np.column_stack([W, tau])
    parts[key] = triangle(np.concatenate([parts[key], rows]) if key in parts else rows)


def _excerpt(
    rows: Rows, kept: NDArray[np.bool_], stride: int, joints: NDArray[np.intp], n: int
) -> Subsample:
    def of_all_joints(values: NDArray) -> NDArray:
        part = values[::stride]
        result = np.zeros((len(part), n, *values.shape[2:]), dtype=values.dtype)
        result[:, joints] = part
        return result

    return Subsample(
        t=rows.t[::stride],
        speed=of_all_joints(rows.speed),
        kept=of_all_joints(kept),
        W=of_all_joints(rows.W),
        tau=of_all_joints(rows.tau),
        tau_rate=of_all_joints(rows.tau_rate),
    )


def _thinned(e: Subsample) -> Subsample:
    """Every other row; a copy, since a view would keep all of them."""
    return Subsample(*(getattr(e, f.name)[::2].copy() for f in fields(e)))


def _joined(parts: list[Subsample]) -> Subsample:
    names = [f.name for f in fields(Subsample)]
    return Subsample(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


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
        DataError: a base parameter that these rows leave free.
    """
    R1, rho1 = R[:-1, :-1], R[:-1, -1]
    scale = np.linalg.norm(R1, axis=0)
    if (scale == 0).any():
        raise DataError("Some base parameters have no effect in these rows; they cannot be fitted.")
    return np.linalg.solve(R1 / scale, rho1) / scale


def condition_number(R: Array) -> float:
    """Ratio of the largest and smallest singular value of W (paper, V-A)."""
    return float(np.linalg.cond(R[:-1, :-1]))
