"""Recordings reduced to triangles as their rows come, so that W is never held.

Along which curves dry friction turns round is not known while the rows come. Until it has been
chosen they are kept with all curves beside W, apart by their distance from a reversal.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.regression.reversal_columns import REGIONS
from ident.regression.rows import Rows
from ident.regression.subsample import Subsample, joined, subsample, thinned
from ident.regression.triangles import triangle
from ident.signals.arrays import Array

K = TypeVar("K", int, tuple[int, int, int])

BLOCKS = 36
"""Equal stretches into which each recording is cut, for held-out checks and error bars."""


EXCERPT = 4000
"""Most instants that an excerpt holds."""


@dataclass(frozen=True)
class Reversals:
    """How Coulomb friction turns round, and how much the rows near a reversal count in a fit.

    Attributes:
        places: column of W with each joint's Coulomb friction, shape (n,); -1 where it has none.
        shapes: parts of the curves in each joint's friction, which sum to one, shape (n, T).
        weights: of the rows of each joint and region, shape (n, REGIONS).
    """

    places: NDArray[np.int64]
    shapes: Array
    weights: Array

    def mixed(self, joint: int, rows: Array) -> Array:
        """Rows [.. | W | curves | tau] with the curves in the place of Coulomb friction.

        Args:
            joint: whose rows these are, from 0.
            rows: shape (.., b + T + 1).
        """
        count = self.shapes.shape[1]
        if count == 0:
            return rows
        result = np.delete(rows, np.s_[-1 - count : -1], axis=-1)
        if self.places[joint] >= 0:
            result[..., self.places[joint]] = rows[..., -1 - count : -1] @ self.shapes[joint]
        return result


@dataclass(frozen=True)
class Unmixed:
    """One recording, reduced, with friction's curves apart.

    Attributes:
        parts: rows [W | curves | tau] or their triangle, by stretch, joint and region.
        raw: the same of the unfiltered rows, by joint.
        count: number of rows, shape (BLOCKS, n, REGIONS).
        culled: number of rows left out because the joint was too slow, shape (n,).
        span_s: begin and end of the rows [s], which the stretches share equally.
        excerpt: some of the rows, culled ones included.
        regressor_s: time that forming the regressor took [s].
    """

    parts: dict[tuple[int, int, int], Array]
    raw: dict[int, Array]
    count: NDArray[np.int64]
    culled: NDArray[np.int64]
    span_s: tuple[float, float]
    excerpt: Subsample
    regressor_s: float

    def with_columns(self, places: Sequence[int]) -> "Unmixed":
        """The same recording, with only some columns of W."""
        b = self.excerpt.W.shape[-1]
        if len(places) == b:
            return self
        last = np.arange(b, b + self.excerpt.curves.shape[-1] + 1)
        chosen = np.concatenate([np.asarray(places), last])
        return replace(
            self,
            parts={key: part[:, chosen] for key, part in self.parts.items()},
            raw={joint: part[:, chosen] for joint, part in self.raw.items()},
            excerpt=replace(self.excerpt, W=self.excerpt.W[..., places]),
        )

    def products(self) -> Array:
        """Inner products of [W | curves | tau], shape (n, REGIONS, c, c)."""
        size = self.excerpt.W.shape[-1] + self.excerpt.curves.shape[-1] + 1
        found = np.zeros((*self.count.shape[1:], size, size))
        for (_, joint, region), part in self.parts.items():
            found[joint, region] += part.T @ part
        return found

    def along(self, reversals: Reversals) -> "Reduction":
        """The recording with friction that turns round along chosen curves."""
        blocks, n, _ = self.count.shape
        size = self.excerpt.W.shape[-1] + 1
        R, R_fit = np.zeros((2, blocks, n, size, size))
        R_raw = np.zeros((n, size, size))
        plain: dict[tuple[int, int], list[Array]] = {}
        weighted: dict[tuple[int, int], list[Array]] = {}
        for (b, j, region), part in self.parts.items():
            rows = reversals.mixed(j, part)
            plain.setdefault((b, j), []).append(rows)
            weighted.setdefault((b, j), []).append(np.sqrt(reversals.weights[j, region]) * rows)
        for place, rows in plain.items():
            R[place] = triangle(np.concatenate(rows))
        if (reversals.weights == 1.0).all():
            R_fit = R
        else:
            for place, rows in weighted.items():
                R_fit[place] = triangle(np.concatenate(rows))
        for j, rows in self.raw.items():
            R_raw[j] = triangle(reversals.mixed(j, rows))
        count = self.count.sum(axis=2)
        excerpt = _along(self.excerpt, reversals)
        return Reduction(
            R,
            R_fit,
            R_raw,
            count,
            self.culled,
            self.span_s,
            excerpt,
            self.excerpt.W,
            self.regressor_s,
        )


def _along(excerpt: Subsample, reversals: Reversals) -> Subsample:
    if reversals.shapes.shape[1] == 0:
        return excerpt
    W = excerpt.W.copy()
    for j, place in enumerate(reversals.places):
        if place >= 0:
            W[:, j, place] = excerpt.curves[:, j] @ reversals.shapes[j]
    return replace(excerpt, W=W, curves=excerpt.curves[..., :0])


@dataclass(frozen=True)
class Reduction:
    """One recording, reduced.

    Attributes:
        R: triangles of [W | tau] per stretch and joint, shape (blocks, n, b + 1, b + 1); zero for
            held joints.
        R_fit: the same with the rows weighted as a fit has them.
        R_raw: triangles of the unfiltered rows, shape (n, b + 1, b + 1).
        count: number of rows in each, shape (blocks, n).
        culled: number of rows left out because the joint was too slow, shape (n,).
        span_s: begin and end of the rows [s], which the stretches share equally.
        excerpt: some of the rows, culled ones included.
        W_sign: regressor of the excerpt with friction that changes its sign at once, as in (3),
            shape (E, n, b).
        regressor_s: time that forming the regressor took [s].
    """

    R: Array
    R_fit: Array
    R_raw: Array
    count: NDArray[np.int64]
    culled: NDArray[np.int64]
    span_s: tuple[float, float]
    excerpt: Subsample
    W_sign: Array
    regressor_s: float

    @property
    def excerpt_at_once(self) -> Subsample:
        """The excerpt with friction that changes its sign at once."""
        return replace(self.excerpt, W=self.W_sign)

    def only(self, stretches: NDArray[np.bool_]) -> "Reduction":
        """The same recording, with only some of its stretches, shape (BLOCKS,)."""
        inside = stretches[block_of(self.excerpt.t, self.span_s)]
        rows = {f.name: getattr(self.excerpt, f.name)[inside] for f in fields(Subsample)}
        keep = stretches[:, None]
        return replace(
            self,
            R=self.R * keep[..., None, None],
            R_fit=self.R_fit * keep[..., None, None],
            count=self.count * keep,
            excerpt=Subsample(**rows),
            W_sign=self.W_sign[inside],
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
) -> Unmixed:
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
    parts: dict[tuple[int, int, int], Array] = {}
    raw: dict[int, Array] = {}
    count = np.zeros((BLOCKS, n, REGIONS), dtype=np.int64)
    excerpts: list[Subsample] = []
    stride, regressor_s = 1, 0.0
    for rows in stream:
        regressor_s += rows.regressor_s
        kept = np.abs(rows.speed) >= threshold_rad_s
        culled[joints] += (~kept).sum(axis=0)
        block = block_of(rows.t, span_s)
        for place, j in enumerate(joints):
            chosen = kept[:, place]
            wide = [rows.W_raw[:, place], rows.curves_raw[:, place], rows.tau_raw[:, place, None]]
            _add(raw, int(j), np.concatenate(wide, axis=1)[chosen])
            wide = [rows.W[:, place], rows.curves[:, place], rows.tau[:, place, None]]
            here = np.concatenate(wide, axis=1)
            for b, region, inside in _groups(block, rows.region[:, place], chosen):
                _add(parts, (b, int(j), region), here[inside])
                count[b, j, region] += inside.sum()
        excerpts.append(subsample(rows, kept, stride, joints, n))
        while sum(len(e.t) for e in excerpts) > EXCERPT:
            stride *= 2
            excerpts = [thinned(e) for e in excerpts]
        del rows  # the stream needs the room for the next ones
    return Unmixed(parts, raw, count, culled, span_s, joined(excerpts), regressor_s)


def _groups(
    block: NDArray[np.int64], region: NDArray[np.int64], chosen: NDArray[np.bool_]
) -> Iterator[tuple[int, int, NDArray[np.bool_]]]:
    """Stretch, region and rows of each group of the chosen rows."""
    number = np.where(chosen, block * REGIONS + region, -1)
    for group in np.unique(number[chosen]):
        yield int(group) // REGIONS, int(group) % REGIONS, number == group


def _add(parts: dict[K, Array], key: K, rows: Array) -> None:
    """Merge rows into the part of that key; many become their triangle."""
    together = np.concatenate([parts[key], rows]) if key in parts else rows
    parts[key] = triangle(together) if len(together) > 2 * together.shape[1] else together
