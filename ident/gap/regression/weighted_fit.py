"""Weighted least squares over all joints, each joint and noise region with its own variance.

Feasible generalised least squares: coefficients and variances are estimated in turn until they
agree, which is the maximum of the normal likelihood.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ident.gap.data.noise_regions import Region
from ident.gap.regression.model_columns import ModelStructure
from ident.gap.regression.normal_equations import NormalEquations
from ident.gap.regression.stacked_equations import StackedEquations, stacked
from ident.signals.arrays import Array

_ROUNDS = 6
_CONVERGED = 1e-4  # change of log sigma
_REVERSAL_INFLATION = 30.0  # of the first noise guess at reversals, where friction may be anything
_RIDGE = 1e-11  # of a column's own length: fixes what the data do not
_ROUNDING = 1e-4  # of a joint's rms torque: smaller residuals are rounding


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
        return self._of_effects(self.x)

    @property
    def effect_variances(self) -> list[Array]:
        """Their variances were all rows independent; of what the data do not fix, huge ones."""
        squares = np.diag(self.normal)
        length = np.sqrt(np.where(squares > 0.0, squares, 1.0))
        scaled = self.normal / np.outer(length, length) + _RIDGE * np.eye(len(length))
        return self._of_effects(np.diag(np.linalg.inv(scaled)) / length**2)

    def _of_effects(self, values: Array) -> list[Array]:
        widths = [e.width for e in self.structure.effects]
        start = len(values) - sum(widths)
        return np.split(values[start:], np.cumsum(widths)[:-1]) if widths else []

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

    def sliding_gain_over(self, other: "Fit") -> float:
        """The part of that sum that comes from rows away from reversals [nats per sample]."""
        before = other.sigma.copy()
        before[:, Region.REVERSAL] = self.sigma[:, Region.REVERSAL]
        return float(mean_log_ratio(before, self.sigma, self.counts).sum())


def mean_log_ratio(before: Array, after: Array, counts: NDArray[np.int64]) -> Array:
    """Mean over each joint's rows of log(before / after), shape (n,); all of shape (n, regions)."""
    ratio = (np.log(before / after) * counts).sum(axis=1)
    return ratio / np.maximum(counts.sum(axis=1), 1)


def mean_squares(model: Fit) -> Array:
    """Mean squared residual of each joint away from its reversals [N^2 m^2], shape (n,)."""
    kept = np.arange(model.sigma.shape[1]) != Region.REVERSAL
    counts = model.counts[:, kept]
    return (model.sigma[:, kept] ** 2 * counts).sum(axis=1) / np.maximum(counts.sum(axis=1), 1)


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
    return fit_stacked(stacked(equations, structure), start)


def fit_stacked(model: StackedEquations, start: Array | None = None) -> Fit:
    """The same from a model's own inner products."""
    counts, squares = model.equations.counts[:, 0], model.squares
    floor, rows = noise_floor(model.equations)[:, None], np.maximum(counts, 1)
    sigma = np.maximum(np.sqrt(squares / rows), floor)
    sigma[:, Region.REVERSAL] *= _REVERSAL_INFLATION
    sigma = sigma if start is None else start
    x, normal = np.zeros(0), np.zeros((0, 0))
    for _ in range(_ROUNDS):
        normal, right = model.normal(1 / sigma**2)
        x = solve(normal, right)
        rss = np.maximum(model.residual_squares(x), 0.0)
        before, sigma = sigma, np.maximum(np.sqrt(rss / rows), floor)
        if np.abs(np.log(sigma / before)).max() < _CONVERGED:
            break
    return Fit(model.structure, x, sigma, counts, normal)


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
    rss = np.maximum(stacked(equations, model.structure).residual_squares(model.x), 0.0)
    found = np.sqrt(rss / np.maximum(equations.counts[:, 0], 1))
    return np.maximum(found, noise_floor(equations)[:, None])
