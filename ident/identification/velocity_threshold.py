"""Velocity culling as in the paper's Fig. 2: what slow samples cost, with two controls.

Static friction is not in the model, and shows near zero velocity only. Leaving slow samples out
must lower the error; leaving out as many samples at random, or at other velocities, must not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.regression.subsample import Subsample
from ident.signals.arrays import Array

THRESHOLDS = (0.0, 0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1)
"""Velocities below which samples are left out [rad/s]."""

_MOST_CONDITION = 1.05
_SHARE_OF_GAIN = 0.5


@dataclass(frozen=True)
class Curve:
    """What is left when samples go, per threshold.

    Attributes:
        condition: condition number of W, shape (T,).
        mse: mean squared residual of OLS on the samples that are left [N^2 m^2], shape (T,).
    """

    condition: Array
    mse: Array


@dataclass(frozen=True)
class Sweep:
    """The figure.

    Attributes:
        thresholds: [rad/s], shape (T,).
        removed: share of the rows that go, shape (T,).
        slow: samples below the threshold are left out.
        random: as many of each joint are left out at random.
        other: as many of each joint are left out from its median velocity upwards.
        choice: the threshold that the rule of `automatic` takes [rad/s].
    """

    thresholds: Array
    removed: Array
    slow: Curve
    random: Curve
    other: Curve
    choice: float


def sweep(excerpts: Sequence[Subsample], thresholds: Sequence[float] = THRESHOLDS) -> Sweep:
    """The effect of culling, on rows before any culling.

    Args:
        excerpts: of each recording.
        thresholds: ascending, the first of them zero [rad/s].
    """
    W = np.concatenate([e.W for e in excerpts])
    tau = np.concatenate([e.tau for e in excerpts])
    speed = np.abs(np.concatenate([e.speed for e in excerpts]))
    joints = np.flatnonzero(np.any(W != 0, axis=(0, 2)))
    bounds = np.asarray(thresholds)
    rng = np.random.default_rng(0)
    bins: list[list[NDArray[np.intp]]] = [[], [], []]
    for j in joints:
        v = speed[:, j]
        share = np.array([np.mean(v < bound) for bound in bounds])
        rank = np.argsort(np.argsort(v)) / len(v)
        beyond = np.where(rank >= 0.5, rank - 0.5, np.inf)
        keys = (
            np.searchsorted(bounds, v, side="right"),
            np.searchsorted(share, rng.uniform(size=len(v)), side="right"),
            np.searchsorted(share, beyond, side="right"),
        )
        for place, key in zip(bins, keys, strict=True):
            place.append(key)
    rows = np.concatenate([np.column_stack([W[:, j], tau[:, j]]) for j in joints])
    slow, random, other = (_curve(rows, np.concatenate(b), len(bounds)) for b in bins)
    gone = np.concatenate(bins[0])
    removed = np.array([np.mean(gone <= i) for i in range(len(bounds))])
    return Sweep(bounds, removed, slow, random, other, automatic(bounds, slow, random))


def _curve(rows: Array, bin_of: NDArray[np.intp], count: int) -> Curve:
    """Condition and error when the rows of bins up to each threshold are gone.

    A row in bin i goes with thresholds from i on; bin `count` never goes. Normal equations of the
    bins are summed up from the last one.
    """
    size = rows.shape[1]
    grams = np.zeros((count + 1, size, size))
    numbers = np.zeros(count + 1)
    for i in range(count + 1):
        part = rows[np.minimum(bin_of, count) == i]
        grams[i], numbers[i] = part.T @ part, len(part)
    left = np.cumsum(grams[::-1], axis=0)[::-1][1:]
    rest = np.cumsum(numbers[::-1])[::-1][1:]
    A, y, square = left[:, :-1, :-1], left[:, :-1, -1], left[:, -1, -1]
    beta = _solved(A, y)
    eigenvalues = np.linalg.eigvalsh(A)
    condition = np.sqrt(eigenvalues[:, -1] / np.maximum(eigenvalues[:, 0], 1e-300))
    return Curve(condition, (square - np.sum(y * beta, axis=1)) / np.maximum(rest, 1.0))


def _solved(A: Array, y: Array) -> Array:
    """Least squares by normal equations; the shortest where too few rows are left, shape (T, b)."""
    try:
        return np.linalg.solve(A, y[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return (np.linalg.pinv(A, hermitian=True) @ y[..., None])[..., 0]


def automatic(thresholds: Array, slow: Curve, random: Curve) -> float:
    """The lowest threshold that brings half of the gain that any of them brings.

    The gain is what the error falls by beyond the random control. Thresholds that raise the
    condition number by more than 5 % are out.
    """
    usable = slow.condition <= _MOST_CONDITION * slow.condition[0]
    usable &= random.mse > 0.0
    gain = np.where(usable, 1 - slow.mse / np.where(usable, random.mse, 1.0), 0.0)
    enough = gain >= _SHARE_OF_GAIN * gain.max()
    return float(thresholds[int(np.argmax(enough))]) if gain.max() > 0 else float(thresholds[0])
