"""Standard errors that hold for filtered, autocorrelated rows of a model that is nearly right.

Rows after a low-pass repeat each other, so that mse (W^T W)^-1 promises far too much; and what the
model gets wrong comes again with each period of the motion. So a recording is cut into stretches,
much longer than the filter's memory, and the variance is the cluster-robust one with the
correction for leverage of Bell and McCaffrey (2002): once with the stretches in which the motion
repeats taken as one, once with all of them apart, as noise would have it. The larger one counts.
What the treatment of friction's reversals leaves open is added: the spread of the parameters over
fewer kinds of curves, and over weights that trust rows near a reversal less.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from ident.estimation.regression_data import RegressionData
from ident.estimation.reversal_shapes import least_squares_with, other_solutions
from ident.identification.repeated_motion import repeated_stretches
from ident.signals.arrays import Array

QUANTILE_90 = 1.645
"""Half width of a 90 % interval in standard errors, which allow for the number of stretches."""

_MOST_LEVERAGE = 0.999
_RIDGE = 1e-12
_ROUNDING = 1e-12  # of the longest column: shorter ones hold rounding errors


def standard_errors(evidence: RegressionData) -> Array:
    """Standard error of each base parameter of the least-squares solution, shape (b,).

    Infinite for those that stand in no row, as where every recording holds their joint.
    """
    triangles = evidence.fitted_triangles
    rows = triangles.reshape(-1, *triangles.shape[-3:])
    grams = np.einsum("snij,snik->sjk", rows, rows)
    motion = repeated_stretches([log.reduction for log in evidence.logs])
    together = _cluster_robust(_summed(grams, motion.groups.ravel()))
    apart = _cluster_robust(_summed(grams, np.arange(len(grams))))
    variance = np.maximum(apart, motion.inflation * together)
    return np.sqrt(variance + _of_reversals(evidence))


def _summed(grams: Array, group: NDArray[np.int64]) -> Array:
    """Inner products of each group that has rows."""
    found = np.zeros((group.max() + 1, *grams.shape[1:]))
    np.add.at(found, group, grams)
    return found[found.any(axis=(1, 2))]


def _cluster_robust(grams: Array) -> Array:
    """Variances that make 90 % intervals of the normal quantile hold, shape (b,).

    Args:
        grams: inner products of [W | tau] of independent groups of rows, shape (G, b + 1, b + 1).
    """
    length = np.sqrt(np.einsum("gjj->j", grams)[:-1])
    seen = np.flatnonzero(length > _ROUNDING * length.max())
    scale, variance = length[seen], np.full(len(length), np.inf)
    A = grams[np.ix_(np.arange(len(grams)), seen, seen)] / np.outer(scale, scale)
    y = grams[:, seen, -1] / scale
    lengths, axes = np.linalg.eigh(A.sum(axis=0))
    root = (axes / np.sqrt(np.maximum(lengths, _RIDGE * lengths[-1]))) @ axes.T
    scores = (y - A @ (root @ root @ y.sum(axis=0))) @ root
    leverage, directions = np.linalg.eigh(root @ A @ root)
    parts = np.einsum("gji,gj->gi", directions, scores)
    parts /= np.sqrt(1 - np.clip(leverage, 0.0, _MOST_LEVERAGE))
    moves = np.einsum("gij,gj->gi", directions, parts) @ root
    small_sample = stdtrit(max(len(grams) - 1, 1), 0.95) / QUANTILE_90
    variance[seen] = small_sample**2 * np.sum(moves**2, axis=0) / scale**2
    return variance


def _of_reversals(evidence: RegressionData) -> Array:
    """Mean square of what the parameters move by with other curves and weights, shape (b,).

    The weights take errors near a reversal for noise. Where they come again with each reversal, as
    those of a joint that sticks, steeper weights are right; both count alike.
    """
    if evidence.products is None:
        return np.zeros(len(evidence.base.kept))
    products, chosen = evidence.products, evidence.reversals
    beta = least_squares_with(products, chosen)
    curves = np.mean([(x - beta) ** 2 for x in other_solutions(products)], axis=0)
    steeper = least_squares_with(products, replace(chosen, weights=chosen.weights**2))
    return curves + 0.5 * (steeper - beta) ** 2
