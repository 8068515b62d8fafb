"""Least squares over all joints, each joint and region with its own noise, from inner products."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ident.gap.data.noise_regions import Region
from ident.gap.regression.normal_equations import NormalEquations

Array = NDArray[np.floating]

_ROUNDS = 6
_SETTLED = 1e-4  # change of log sigma
_DOUBT = 30.0  # times: what a joint holds at rest tells little; believed at first, it may win
_RIDGE = 1e-11  # of a column's own length: fixes what the data do not
_TRUST = 1e-4  # of a joint's rms torque: smaller errors are rounding, not knowledge


@dataclass(frozen=True)
class ColumnIndex:
    """Columns of one hypothesis.

    Attributes:
        joints: the joints whose torque they change, from 0.
        starts: first column in each of those joints' layouts, counted from `first_extra`.
        width: number of coefficients.
    """

    joints: tuple[int, ...]
    starts: tuple[int, ...]
    width: int


@dataclass(frozen=True)
class ModelStructure:
    """Which columns the model has.

    Attributes:
        shapes: parts of the reversal curves in each joint's friction, shape (n, T).
        slots: effects in the model.
    """

    shapes: Array
    slots: tuple[ColumnIndex, ...] = ()

    def turned(self, joint: int, shape: Array) -> "ModelStructure":
        """The same with other reversal curves of one joint."""
        shapes = self.shapes.copy()
        shapes[joint] = shape
        return ModelStructure(shapes, self.slots)

    def with_slot(self, slot: ColumnIndex) -> "ModelStructure":
        """The same with one more effect."""
        return ModelStructure(self.shapes, (*self.slots, slot))


@dataclass(frozen=True)
class Places:
    """The model's columns on one joint.

    Attributes:
        local: the joint's columns that they are made of, shape (l,).
        mix: how: reversal curves are mixed to one, all others stand for themselves, shape (l, k).
        unknown: which unknown multiplies each, shape (k,).
    """

    local: NDArray[np.int64]
    mix: Array
    unknown: NDArray[np.int64]

    def of(self, columns: Array) -> Array:
        """The model's columns, shape (R, k), from all columns, shape (R, p)."""
        return columns[:, self.local] @ self.mix

    def inner(self, products: Array) -> Array:
        """Inner products of the model's columns, shape (..., k, k)."""
        return self.mix.T @ products[..., self.local[:, None], self.local] @ self.mix

    def across(self, products: Array, others: NDArray[np.int64]) -> Array:
        """Inner products of the model's columns with others, shape (..., k, m)."""
        return self.mix.T @ products[..., self.local[:, None], others]

    def torque(self, products: Array) -> Array:
        """Inner products of the model's columns with the torque, shape (..., k)."""
        return products[..., self.local, -1] @ self.mix


@dataclass(frozen=True)
class Fit:
    """A solution.

    Attributes:
        choice: the model's columns.
        x: unknowns: base inertial parameters, viscous, Coulomb, then the effects' coefficients.
        sigma: rms residual per joint and region [N m], shape (n, regions).
        counts: rows per joint and region, shape (n, regions).
        normal: weighted inner products of the unknowns' columns, shape (p, p).
    """

    choice: ModelStructure
    x: Array
    sigma: Array
    counts: NDArray[np.int64]
    normal: Array

    @property
    def effects(self) -> list[Array]:
        """Coefficients of each effect."""
        widths = [s.width for s in self.choice.slots]
        start = len(self.x) - sum(widths)
        return np.split(self.x[start:], np.cumsum(widths)[:-1]) if widths else []

    @property
    def viscous(self) -> Array:
        """Viscous friction of each joint [N m s/rad], shape (n,)."""
        n, widths = len(self.sigma), sum(s.width for s in self.choice.slots)
        first = len(self.x) - widths - 2 * n
        return self.x[first : first + n]

    def gains_over(self, other: "Fit") -> Array:
        """Mean log ratio of the residuals of each joint [nats per sample], shape (n,).

        This is the difference of the log-likelihoods per sample.
        """
        return mean_log_ratio(other.sigma, self.sigma, self.counts)

    def gain_over(self, other: "Fit") -> float:
        """Sum of the joints' gains [nats per sample]."""
        return float(self.gains_over(other).sum())


def mean_log_ratio(before: Array, after: Array, counts: NDArray[np.int64]) -> Array:
    """Mean over each joint's rows of log(before / after), shape (n,); all of shape (n, regions)."""
    ratio = (np.log(before / after) * counts).sum(axis=1)
    return ratio / np.maximum(counts.sum(axis=1), 1)


def mean_squares(model: Fit) -> Array:
    """Mean squared residual of each joint where it slides [N^2 m^2], shape (n,)."""
    kept = np.arange(model.sigma.shape[1]) != Region.REVERSAL
    counts = model.counts[:, kept]
    return (model.sigma[:, kept] ** 2 * counts).sum(axis=1) / np.maximum(counts.sum(axis=1), 1)


def places(grams: NormalEquations, choice: ModelStructure) -> list[Places]:
    """The chosen columns of each joint."""
    n, b = grams.dof, grams.base
    starts = b + 2 * n + np.cumsum([0, *(s.width for s in choice.slots)])
    found = []
    for j, layout in enumerate(grams.layouts):
        used = np.flatnonzero(choice.shapes[j])
        alone = [*range(len(layout.base)), layout.viscous]
        effects: list[int] = []
        unknown = [*layout.base, b + j, b + n + j]
        for slot, start in zip(choice.slots, starts, strict=False):
            if j in slot.joints:
                first = layout.first_extra + slot.starts[slot.joints.index(j)]
                effects += range(first, first + slot.width)
                unknown += range(start, start + slot.width)
        local = np.array([*alone, *(layout.first_turning + used), *effects])
        a, t, e = len(alone), len(used), len(effects)
        mix = np.zeros((a + t + e, a + 1 + e))
        mix[:a, :a] = np.eye(a)
        mix[a : a + t, a] = choice.shapes[j, used]
        mix[a + t :, a + 1 :] = np.eye(e)
        found.append(Places(local, mix, np.array(unknown)))
    return found


def trusted(grams: NormalEquations) -> Array:
    """Smallest residual that is believed, per joint [N m], shape (n,)."""
    squares = [p[..., -1, -1].sum() for p in grams.products]
    rows = np.maximum(grams.counts.sum(axis=(1, 2)), 1)
    rounding = np.maximum(_TRUST * np.sqrt(np.array(squares) / rows), 1e-12)
    return rounding if grams.least is None else np.maximum(rounding, grams.least)


def fit(grams: NormalEquations, choice: ModelStructure, start: Array | None = None) -> Fit:
    """The model's best coefficients, with the noise of each joint and region estimated alongside.

    Args:
        grams: inner products of the data to use, as one fold.
        choice: the model's columns.
        start: first guess of the noise [N m], shape (n, regions).
    """
    counts, chosen = grams.counts[:, 0], places(grams, choice)
    parts = [pl.inner(p[0]) for p, pl in zip(grams.products, chosen, strict=True)]
    rights = [pl.torque(p[0]) for p, pl in zip(grams.products, chosen, strict=True)]
    squares = np.array([p[0][:, -1, -1] for p in grams.products])
    least = trusted(grams)[:, None]
    rows = np.maximum(counts, 1)
    sigma = np.maximum(np.sqrt(squares / rows), least)
    sigma[:, Region.REVERSAL] *= _DOUBT
    sigma = sigma if start is None else start
    size = 1 + max(int(pl.unknown.max()) for pl in chosen)
    x, normal = np.zeros(size), np.zeros((size, size))
    for _ in range(_ROUNDS):
        normal, right = _normal(parts, rights, chosen, sigma, size)
        x = solve(normal, right)
        rss = np.array(
            [
                s - 2 * (r @ x[pl.unknown]) + (p @ x[pl.unknown]) @ x[pl.unknown]
                for s, r, p, pl in zip(squares, rights, parts, chosen, strict=True)
            ]
        )
        before, sigma = sigma, np.maximum(np.sqrt(np.maximum(rss, 0.0) / rows), least)
        if np.abs(np.log(sigma / before)).max() < _SETTLED:
            break
    return Fit(choice, x, sigma, counts, normal)


def _normal(
    parts: list[Array], rights: list[Array], chosen: list[Places], sigma: Array, size: int
) -> tuple[Array, Array]:
    normal, right = np.zeros((size, size)), np.zeros(size)
    for part, r, pl, s in zip(parts, rights, chosen, sigma, strict=True):
        weight = 1 / s**2
        normal[np.ix_(pl.unknown, pl.unknown)] += np.tensordot(weight, part, axes=1)
        right[pl.unknown] += weight @ r
    return normal, right


def solve(normal: Array, right: Array) -> Array:
    """Solution of the normal equations, columns scaled to one, directions without data at zero."""
    scale = np.sqrt(np.diag(normal))
    used = scale > 0.0
    scale = np.where(used, scale, 1.0)
    matrix = normal / scale[:, None] / scale + np.diag(np.where(used, _RIDGE, 1.0))
    scaled = (right.T / scale).T
    factor = scipy.linalg.cho_factor(matrix, lower=True, overwrite_a=True, check_finite=False)
    return (scipy.linalg.cho_solve(factor, scaled, check_finite=False).T / scale).T


def predicted_rms(grams: NormalEquations, model: Fit) -> Array:
    """Rms residual [N m] of a fit on other data, given as one fold, shape (n, regions)."""
    found = np.zeros_like(model.sigma)
    for j, pl in enumerate(places(grams, model.choice)):
        x, products = model.x[pl.unknown], grams.products[j][0]
        rss = products[:, -1, -1] - 2 * pl.torque(products) @ x + (pl.inner(products) @ x) @ x
        found[j] = np.sqrt(np.maximum(rss, 0.0) / np.maximum(grams.counts[j, 0], 1))
    return np.maximum(found, trusted(grams)[:, None])
