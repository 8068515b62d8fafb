"""Iteratively reweighted least squares: rows with large residuals count less (Huber's weights)."""

import numpy as np

from ident.estimation.problem import Estimate, ordinary, solved
from ident.estimation.regression_data import RegressionData
from ident.signals.arrays import Array

_HUBER = 1.345
_SIGMA_OF_MEDIAN = 1.4826
_ROUNDS = 30
_CHANGE = 1e-4


def irls(evidence: RegressionData) -> Estimate:
    """Least squares that outliers cannot pull: full weight up to 1.345 sigma of each log and joint.

    Works on the excerpts, since single rows need single weights.
    """
    groups = [rows for log in evidence.logs for rows in log.reduction.excerpt.rows() if len(rows)]
    beta = ordinary(evidence.problem())
    for _ in range(_ROUNDS):
        new = solved(np.sum([_weighted_gram(rows, beta) for rows in groups], axis=0))
        change = np.linalg.norm(new - beta) / np.linalg.norm(new)
        beta = new
        if change < _CHANGE:
            break
    return Estimate(beta)


def _weighted_gram(rows: Array, beta: Array) -> Array:
    size = np.abs(rows @ np.append(-beta, 1.0))
    sigma = max(_SIGMA_OF_MEDIAN * float(np.median(size)), 1e-12)
    weight = np.minimum(1.0, _HUBER * sigma / np.maximum(size, sigma)) / sigma**2
    return rows.T @ (weight[:, None] * rows)
