"""What a design minimises: the paper's condition number, or the parameters' standard errors."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ident.excitation.problem.regressor_columns import Columns
from ident.signals.arrays import Array

_FLOOR = 1e-14
_RIDGE = 1e-12

_PRICE = 20.0
"""Of a condition number above its bound, per unit of its logarithm; no error is worth as much."""

_SLOPE = 10.0
"""The price on the way there: enough to end at the bound, and small beside that of the limits."""

_SOFT = 0.005
"""How far below its bound, in the logarithm, a condition number begins to cost."""

_SPARE = 0.012
"""So far below its bound, in the logarithm, it is aimed at: bringing a motion into limits costs."""


@dataclass(frozen=True)
class Objective:
    """How good a regressor is.

    Attributes:
        kind: `condition`, the ratio of the largest to the smallest singular value of W (paper,
            V-A); `determinant`, the D-optimal volume of the parameters' errors; `errors`, the
            geometric mean of their standard errors; `balanced`, condition number times that mean.
            Volume and mean do not depend on units.
        weights: of each column, shape (b,); a parameter of weight 2 must be seen twice as well
            (condition), or its own error counts twice (determinant, errors), or both.
        most: condition number above which nothing counts as much as its fall.
    """

    kind: Literal["condition", "determinant", "errors", "balanced"]
    weights: Array
    most: float = np.inf


def gram(columns: Columns, rows: Array) -> Array:
    """W^T W / (S n), shape (b, b), of rows of shape (n, S, b)."""
    found = np.zeros((rows.shape[2], rows.shape[2]))
    for first, part in zip(columns.first, rows, strict=True):
        found[first:, first:] += part[:, first:].T @ part[:, first:]
    return found / (rows.shape[0] * rows.shape[1])


def gram_vjp(columns: Columns, rows: Array, slope: Array) -> Array:
    """Gradient by the rows, shape (n, S, b), of anything whose slope by `gram` is (b, b)."""
    bar = np.zeros_like(rows)
    scaled = slope * (2.0 / (rows.shape[0] * rows.shape[1]))
    for first, part, out in zip(columns.first, rows, bar, strict=True):
        out[:, first:] = part[:, first:] @ scaled[first:, first:]
    return bar


def value_and_slope(objective: Objective, found: Array, power: float) -> tuple[float, Array]:
    """What the condition number adds to the objective, and its symmetric slope, shape (b, b).

    Args:
        objective: kind and weights.
        found: Gram matrix of the columns, shape (b, b).
        power: of the norm that stands in for the largest and smallest singular value; the higher,
            the closer, and the less smooth.
    """
    scale = np.outer(1.0 / objective.weights, 1.0 / objective.weights)
    value, slope = _condition(found * scale, power)
    value, push = _counted(objective, value, _SLOPE)
    return value, push * slope * scale


def value_and_slopes(
    objective: Objective, found: Array, noisy: Array, power: float
) -> tuple[float, Array, Array]:
    """The objective, and its symmetric slopes by the two Gram matrices, shape (b, b).

    Args:
        objective: kind and weights.
        found: Gram matrix of the columns, shape (b, b).
        noisy: the same of rows that are multiplied by their noise, shape (b, b).
        power: as in `value_and_slope`.
    """
    value, slope = value_and_slope(objective, found, power)
    errors, rest, by_noise = _errors(objective, found, noisy)
    return value + errors, slope + rest, by_noise


def aimed(objective: Objective, found: Array, rows: Array, power: float) -> Objective:
    """The objective whose smooth condition number meets the bound where the true one does.

    Args:
        objective: with its bound.
        found: Gram matrix of the smooth columns, shape (b, b).
        rows: the sharp columns at the same motion, shape (rows, b).
        power: of the norm, as in `value_and_slope`.
    """
    if not np.isfinite(objective.most):
        return objective
    scale = np.outer(1.0 / objective.weights, 1.0 / objective.weights)
    smooth, _ = _condition(found * scale, power)
    sharp = float(np.log(np.linalg.cond(rows / objective.weights)))
    return replace(objective, most=objective.most * float(np.exp(smooth - sharp - _SPARE)))


def sharp_condition(objective: Objective, rows: Array) -> float:
    """What the condition number of W itself, shape (rows, b), adds to the objective."""
    condition = float(np.log(np.linalg.cond(rows / objective.weights)))
    return _counted(objective, condition, _PRICE)[0]


def sharp_errors(objective: Objective, rows: Array, variance: Array) -> float:
    """What the standard errors add to it, by a formula for the noise.

    Args:
        objective: kind, weights and bound.
        rows: W, shape (rows, b).
        variance: of each row's noise, shape (rows,).
    """
    if objective.kind == "condition":
        return 0.0
    noisy = (rows.T * variance) @ rows / len(rows)
    return _errors(objective, rows.T @ rows / len(rows), noisy)[0]


def sharp_value(objective: Objective, rows: Array, variance: Array) -> float:
    """The objective of W itself: with its true singular values; arguments as of its parts."""
    return sharp_condition(objective, rows) + sharp_errors(objective, rows, variance)


def _counted(objective: Objective, logarithm: float, price: float) -> tuple[float, float]:
    """What a condition number's logarithm adds to the objective, and the slope by it."""
    wanted = float(objective.kind in ("condition", "balanced"))
    if not np.isfinite(objective.most):
        return wanted * logarithm, wanted
    above = (logarithm - np.log(objective.most)) / _SOFT
    excess = float(np.logaddexp(0.0, above))
    push = price * float(np.exp(above - excess))
    return wanted * logarithm + price * _SOFT * excess, wanted + push


def _errors(objective: Objective, found: Array, noisy: Array) -> tuple[float, Array, Array]:
    if objective.kind == "determinant":
        return _spread(1.0, objective.weights - 1.0, found, noisy)
    return _spread(0.0, objective.weights, found, noisy)


def _condition(found: Array, power: float) -> tuple[float, Array]:
    """Logarithm of the condition number of W, by sums of powers of the eigenvalues."""
    values, vectors = np.linalg.eigh(found)
    values = np.maximum(values, _FLOOR * values[-1])
    logs = power * np.log(values)
    high, low = np.exp(logs - logs[-1]), np.exp(logs[0] - logs)
    value = (logs[-1] + np.log(high.sum()) - logs[0] + np.log(low.sum())) / (2.0 * power)
    weights = (high / high.sum() - low / low.sum()) / (2.0 * values)
    return float(value), (vectors * weights) @ vectors.T


def _spread(volume: float, own: Array, found: Array, noisy: Array) -> tuple[float, Array, Array]:
    """Mean logarithm of the standard errors: of their volume, and of the parameters' own.

    Least squares has the covariance P B P, with P the inverse of W^T W, and B as W^T W, but of rows
    that are multiplied by their noise.
    """
    inverse = _inverse(found)
    covariance = inverse @ noisy @ inverse
    variance = np.diag(covariance)
    total = 2.0 * (volume * len(own) + own.sum())
    value = own @ np.log(variance)
    weighted = inverse * (own / variance)
    by_gram, by_noise = -(covariance @ weighted.T), weighted @ inverse
    by_gram = by_gram + by_gram.T
    if volume:
        value += volume * (np.linalg.slogdet(noisy)[1] + 2.0 * np.linalg.slogdet(inverse)[1])
        by_gram, by_noise = by_gram - 2.0 * volume * inverse, by_noise + np.linalg.inv(noisy)
    return float(value) / total, by_gram / total, by_noise / total


def _inverse(found: Array) -> Array:
    """Of a Gram matrix, which may be singular but for a hair."""
    ridge = _RIDGE * float(np.trace(found)) * np.eye(len(found))
    half = np.linalg.inv(np.linalg.cholesky(found + ridge))
    return half.T @ half
