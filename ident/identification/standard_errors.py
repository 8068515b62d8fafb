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
    return np.linalg.norm(joint_errors(evidence), axis=1)


def joint_errors(evidence: RegressionData) -> Array:
    """Triangular root of the covariance of the base parameters, shape (b, k).

    Each column is what an independent error of size one does to all parameters; the length of a row
    is the standard error of its parameter, infinite where it stands in no row. Parameters go
    together as they do over stretches apart and over the treatments of reversals.
    """
    triangles = evidence.fitted_triangles
    rows = triangles.reshape(-1, *triangles.shape[-3:])
    grams = np.einsum("snij,snik->sjk", rows, rows)
    motion = repeated_stretches([log.reduction for log in evidence.logs])
    together = _squares(_cluster_robust(_summed(grams, motion.groups.ravel())))
    moves = _cluster_robust(_summed(grams, np.arange(len(grams))))
    reversals = _of_reversals(evidence)
    sd = np.sqrt(np.maximum(_squares(moves), motion.inflation * together) + _squares(reversals))
    seen = np.isfinite(sd)
    root = np.linalg.qr(np.where(seen, np.concatenate([moves, reversals]), 0.0)).R.T
    lengths = np.linalg.norm(root, axis=1)
    root *= (np.where(seen, sd, 0.0) / np.where(lengths > 0.0, lengths, 1.0))[:, None]
    root[~seen, 0] = np.inf
    return root


def _squares(moves: Array) -> Array:
    """Variances, shape (b,), from independent moves of the parameters, shape (k, b)."""
    return np.sum(moves**2, axis=0)


def _summed(grams: Array, group: NDArray[np.int64]) -> Array:
    """Inner products of each group that has rows."""
    found = np.zeros((group.max() + 1, *grams.shape[1:]))
    np.add.at(found, group, grams)
    return found[found.any(axis=(1, 2))]


def _cluster_robust(grams: Array) -> Array:
    """Moves of the parameters, shape (G, b): the sum of their squares is the variance.

    It makes 90 % intervals of the normal quantile hold; infinite where no row tells a parameter.

    Args:
        grams: inner products of [W | tau] of independent groups of rows, shape (G, b + 1, b + 1).
    """
    length = np.sqrt(np.einsum("gjj->j", grams)[:-1])
    seen = np.flatnonzero(length > _ROUNDING * length.max())
    scale, found = length[seen], np.full((len(grams), len(length)), np.inf)
    A = grams[np.ix_(np.arange(len(grams)), seen, seen)] / np.outer(scale, scale)
    y = grams[:, seen, -1] / scale
    lengths, axes = np.linalg.eigh(A.sum(axis=0))
    root = (axes / np.sqrt(np.maximum(lengths, _RIDGE * lengths[-1]))) @ axes.T
    scores = (y - A @ (root @ root @ y.sum(axis=0))) @ root
    leverage, directions = np.linalg.eigh(root @ A @ root)
    parts = np.einsum("gji,gj->gi", directions, scores)
    parts /= np.sqrt(1 - np.clip(leverage, 0.0, _MOST_LEVERAGE))
    moves = np.einsum("gij,gj->gi", directions, parts) @ root / scale
    small_sample = stdtrit(max(len(grams) - 1, 1), 0.95) / QUANTILE_90
    found[:, seen] = small_sample * moves
    return found


def _of_reversals(evidence: RegressionData) -> Array:
    """What the parameters move by with other curves and weights, shape (k, b).

    The weights take errors near a reversal for noise. Where they come again with each reversal, as
    those of a joint that sticks, steeper weights are right; both count alike.
    """
    if evidence.products is None:
        return np.zeros((0, len(evidence.base.kept)))
    products, chosen = evidence.products, evidence.reversals
    beta = least_squares_with(products, chosen)
    curves = list(other_solutions(products))
    steeper = least_squares_with(products, replace(chosen, weights=chosen.weights**2))
    shares = np.sqrt([*(1 / len(curves) for _ in curves), 0.5])
    return shares[:, None] * (np.array([*curves, steeper]) - beta)
