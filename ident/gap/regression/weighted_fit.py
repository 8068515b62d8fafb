"""Weighted least squares over all joints, each joint and noise region with its own variance.

Feasible generalised least squares: coefficients and variances are estimated in turn until they
agree, which is the maximum of the normal likelihood.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ident.gap.data.noise_regions import Region
from ident.gap.regression.normal_equations import NormalEquations
from ident.signals.arrays import Array

_ROUNDS = 6
_CONVERGED = 1e-4  # change of log sigma
_REVERSAL_INFLATION = 30.0  # of the first noise guess at reversals, where friction may be anything
_RIDGE = 1e-11  # of a column's own length: fixes what the data do not
_ROUNDING = 1e-4  # of a joint's rms torque: smaller residuals are rounding


@dataclass(frozen=True)
class ColumnIndex:
    """Position of one effect's columns.

    Attributes:
        joints: the joints whose torque the effect changes, from 0.
        starts: first column on each of those joints, counted from `Layout.first_effect`.
        width: number of coefficients.
    """

    joints: tuple[int, ...]
    starts: tuple[int, ...]
    width: int


@dataclass(frozen=True)
class ModelStructure:
    """Which columns a model has.

    Attributes:
        shapes: share of each reversal curve in each joint's friction, shape (n, T).
        effects: columns of the effects in the model.
    """

    shapes: Array
    effects: tuple[ColumnIndex, ...] = ()

    def with_shape(self, joint: int, shape: Array) -> "ModelStructure":
        """The same with other reversal curves of one joint."""
        shapes = self.shapes.copy()
        shapes[joint] = shape
        return ModelStructure(shapes, self.effects)

    def with_effect(self, effect: ColumnIndex) -> "ModelStructure":
        """The same with one more effect."""
        return ModelStructure(self.shapes, (*self.effects, effect))


@dataclass(frozen=True)
class JointColumns:
    """A model's columns on one joint.

    Attributes:
        local: the joint's columns that they are made of, shape (l,).
        mix: their weights, shape (l, k): reversal curves are mixed to one column, all other columns
            are taken as they are.
        unknown: index of the unknown that multiplies each, shape (k,).
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
        structure: the model's columns.
        x: unknowns: base inertial parameters, viscous, Coulomb, then the effects' coefficients.
        sigma: rms residual per joint and region [N m], shape (n, regions).
        counts: rows per joint and region, shape (n, regions).
        normal: weighted inner products of the unknowns' columns, shape (p, p).
    """

    structure: ModelStructure
    x: Array
    sigma: Array
    counts: NDArray[np.int64]
    normal: Array

    @property
    def effects(self) -> list[Array]:
        """Coefficients of each effect."""
        widths = [e.width for e in self.structure.effects]
        start = len(self.x) - sum(widths)
        return np.split(self.x[start:], np.cumsum(widths)[:-1]) if widths else []

    @property
    def viscous(self) -> Array:
        """Viscous friction of each joint [N m s/rad], shape (n,)."""
        return self._friction[0]

    @property
    def coulomb(self) -> Array:
        """Coulomb friction of each joint [N m], shape (n,)."""
        return self._friction[1]

    @property
    def _friction(self) -> Array:
        n, widths = len(self.sigma), sum(e.width for e in self.structure.effects)
        end = len(self.x) - widths
        return self.x[end - 2 * n : end].reshape(2, n)

    def gains_over(self, other: "Fit") -> Array:
        """Log-likelihood beyond another fit's, per joint [nats per sample], shape (n,).

        For normal residuals it is the mean log ratio of the rms residuals.
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
    """Mean squared residual of each joint away from its reversals [N^2 m^2], shape (n,)."""
    kept = np.arange(model.sigma.shape[1]) != Region.REVERSAL
    counts = model.counts[:, kept]
    return (model.sigma[:, kept] ** 2 * counts).sum(axis=1) / np.maximum(counts.sum(axis=1), 1)


def joint_columns(equations: NormalEquations, structure: ModelStructure) -> list[JointColumns]:
    """The model's columns on each joint."""
    n, b = equations.dof, equations.base
    starts = b + 2 * n + np.cumsum([0, *(e.width for e in structure.effects)])
    found = []
    for j, layout in enumerate(equations.layouts):
        used = np.flatnonzero(structure.shapes[j])
        alone = [*range(len(layout.base)), layout.viscous]
        effects: list[int] = []
        unknown = [*layout.base, b + j, b + n + j]
        for effect, start in zip(structure.effects, starts, strict=False):
            if j in effect.joints:
                first = layout.first_effect + effect.starts[effect.joints.index(j)]
                effects += range(first, first + effect.width)
                unknown += range(start, start + effect.width)
        local = np.array([*alone, *(layout.first_reversal + used), *effects])
        a, t, e = len(alone), len(used), len(effects)
        mix = np.zeros((a + t + e, a + 1 + e))
        mix[:a, :a] = np.eye(a)
        mix[a : a + t, a] = structure.shapes[j, used]
        mix[a + t :, a + 1 :] = np.eye(e)
        found.append(JointColumns(local, mix, np.array(unknown)))
    return found


def noise_floor(equations: NormalEquations) -> Array:
    """Smallest rms residual that is believed, per joint [N m], shape (n,).

    Rounding, or the error of a reference model, whichever is larger.
    """
    squares = [p[..., -1, -1].sum() for p in equations.products]
    rows = np.maximum(equations.counts.sum(axis=(1, 2)), 1)
    rounding = np.maximum(_ROUNDING * np.sqrt(np.array(squares) / rows), 1e-12)
    error = equations.reference_error
    return rounding if error is None else np.maximum(rounding, error)


def fit(equations: NormalEquations, structure: ModelStructure, start: Array | None = None) -> Fit:
    """The model's best coefficients, with the noise of each joint and region.

    Args:
        equations: inner products of the data to use, as one fold.
        structure: the model's columns.
        start: first guess of the noise [N m], shape (n, regions).
    """
    counts, chosen = equations.counts[:, 0], joint_columns(equations, structure)
    parts = [c.inner(p[0]) for p, c in zip(equations.products, chosen, strict=True)]
    rights = [c.torque(p[0]) for p, c in zip(equations.products, chosen, strict=True)]
    squares = np.array([p[0][:, -1, -1] for p in equations.products])
    floor, rows = noise_floor(equations)[:, None], np.maximum(counts, 1)
    sigma = np.maximum(np.sqrt(squares / rows), floor)
    sigma[:, Region.REVERSAL] *= _REVERSAL_INFLATION
    sigma = sigma if start is None else start
    size = 1 + max(int(c.unknown.max()) for c in chosen)
    x, normal = np.zeros(size), np.zeros((size, size))
    for _ in range(_ROUNDS):
        normal, right = _normal(parts, rights, chosen, sigma, size)
        x = solve(normal, right)
        rss = np.array(
            [
                s - 2 * (r @ x[c.unknown]) + (p @ x[c.unknown]) @ x[c.unknown]
                for s, r, p, c in zip(squares, rights, parts, chosen, strict=True)
            ]
        )
        before, sigma = sigma, np.maximum(np.sqrt(np.maximum(rss, 0.0) / rows), floor)
        if np.abs(np.log(sigma / before)).max() < _CONVERGED:
            break
    return Fit(structure, x, sigma, counts, normal)


def _normal(
    parts: list[Array], rights: list[Array], chosen: list[JointColumns], sigma: Array, size: int
) -> tuple[Array, Array]:
    """Weighted normal matrix and right-hand side of all joints together."""
    normal, right = np.zeros((size, size)), np.zeros(size)
    for part, r, c, s in zip(parts, rights, chosen, sigma, strict=True):
        weight = 1 / s**2
        normal[np.ix_(c.unknown, c.unknown)] += np.tensordot(weight, part, axes=1)
        right[c.unknown] += weight @ r
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


def predicted_rms(equations: NormalEquations, model: Fit) -> Array:
    """Rms residual [N m] of a fit on other data, given as one fold, shape (n, regions)."""
    found = np.zeros_like(model.sigma)
    for j, c in enumerate(joint_columns(equations, model.structure)):
        x, products = model.x[c.unknown], equations.products[j][0]
        rss = products[:, -1, -1] - 2 * c.torque(products) @ x + (c.inner(products) @ x) @ x
        found[j] = np.sqrt(np.maximum(rss, 0.0) / np.maximum(equations.counts[j, 0], 1))
    return np.maximum(found, noise_floor(equations)[:, None])
