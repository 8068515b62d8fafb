"""Instrumental variables: the reference motion stands in for the measured one (IDIM-IV).

Noise in the measured position is in W and in the residual alike, which biases least squares when
the filter does not remove it (errors in variables). The wanted motion knows nothing of that noise:
with Z the regressor along it, beta = (Z^T W)^-1 Z^T tau is free of the bias (Janot, Vandanjon,
Gautier 2014). Where the two answers differ by more than chance, the filter was not good enough
(Hausman's test).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ident.recordings.dataset import Dataset
from ident.regression.filters import Processing
from ident.regression.reduction import BLOCKS, block_of
from ident.regression.rows import Regressor, rows_of
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError


@dataclass(frozen=True)
class Moments:
    """Z^T [W | tau] and W^T [W | tau] of each stretch, shape (stretches, b, b + 1) each."""

    instrumental: Array
    ordinary: Array

    def only(self, stretches: NDArray[np.bool_]) -> "Moments":
        """The same, with only some stretches, shape (stretches,)."""
        keep = stretches[:, None, None]
        return Moments(self.instrumental * keep, self.ordinary * keep)

    def with_columns(self, places: Sequence[int]) -> "Moments":
        """The same, with only some columns of W."""
        both = np.append(places, self.ordinary.shape[1])
        parts = (x[:, places][..., both] for x in (self.instrumental, self.ordinary))
        return Moments(*parts)


@dataclass(frozen=True)
class BiasTest:
    """Hausman's comparison of OLS with instrumental variables.

    Attributes:
        z: their difference in units of its own standard error, by leaving out stretches, shape
            (b,).
        largest: the largest |z|.
        bound: what it exceeds by chance in 5 % of unbiased cases (Bonferroni, normal).
    """

    z: Array
    largest: float
    bound: float

    @property
    def biased(self) -> bool:
        """Whether OLS was biased by noise in the position."""
        return self.largest > self.bound


def moments(data: Dataset, process: Processing, regressor: Regressor) -> Moments:
    """Products of regressor, instruments, and torque of one recording.

    Raises:
        DataError: a log without reference motion, which instruments need.
    """
    if not data.has_reference:
        raise DataError(
            f"{data.name} holds no reference motion (/joint_reference), which iv needs:"
            " leave iv out."
        )
    b = len(regressor.base.kept)
    instrumental, ordinary = np.zeros((2, BLOCKS, b, b + 1))
    streams = (
        rows_of(data, process, regressor),
        rows_of(data.along_reference(), process, regressor),
    )
    for measured, reference in zip(*streams, strict=True):
        kept = np.abs(measured.speed) >= process.threshold_rad_s
        stretch = block_of(measured.t, data.span_s)
        right = np.concatenate([measured.W, measured.tau[..., None]], axis=2)
        for s in np.unique(stretch):
            chosen = kept & (stretch == s)[:, None]
            instrumental[s] += reference.W[chosen].T @ right[chosen]
            ordinary[s] += measured.W[chosen].T @ right[chosen]
    return Moments(instrumental, ordinary)


def joined(parts: Sequence[Moments]) -> Moments:
    """The stretches of several recordings."""
    return Moments(
        np.concatenate([p.instrumental for p in parts]), np.concatenate([p.ordinary for p in parts])
    )


def instrumental_solution(found: Moments) -> Array:
    """(Z^T W)^-1 Z^T tau, shape (b,)."""
    return _solved(found.instrumental.sum(axis=0))


def bias_test(found: Moments) -> BiasTest:
    """Whether OLS and instrumental variables differ by more than chance."""
    used = np.any(found.ordinary != 0, axis=(1, 2))
    iv, ols = found.instrumental[used], found.ordinary[used]
    without = np.array(
        [
            _solved(iv.sum(axis=0) - a) - _solved(ols.sum(axis=0) - b)
            for a, b in zip(iv, ols, strict=True)
        ]
    )
    count = len(without)
    sd = np.sqrt((count - 1) / count * np.sum((without - without.mean(axis=0)) ** 2, axis=0))
    z = (_solved(iv.sum(axis=0)) - _solved(ols.sum(axis=0))) / sd
    return BiasTest(z, float(np.abs(z).max()), float(-ndtri(0.025 / len(z))))


def _solved(moment: Array) -> Array:
    """Solution of A beta = y, with [A | y] scaled row by row and column by column."""
    A, y = moment[:, :-1], moment[:, -1]
    rows = np.linalg.norm(A, axis=1)
    A, y = A / rows[:, None], y / rows
    columns = np.linalg.norm(A, axis=0)
    return np.linalg.solve(A / columns, y) / columns
