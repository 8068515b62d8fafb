"""Squared residuals summed over rows, and the errors that follow from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.regression.triangles import squared_error, squared_torque
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Errors:
    """Of one set of rows.

    Attributes:
        mse: mean squared residual [N^2 m^2].
        relative_percent: ||tau - W beta|| / ||tau|| over all joints [%].
        relative_percent_by_joint: the same per joint [%], shape (n,); NaN for held joints.
        rms_by_joint: residual [N m], shape (n,); NaN for held joints.
    """

    mse: float
    relative_percent: float
    relative_percent_by_joint: Array
    rms_by_joint: Array


@dataclass(frozen=True)
class Sums:
    """Squared residual and torque [N^2 m^2] and number of rows per joint, each of shape (n,)."""

    residual: Array
    torque: Array
    rows: Array

    def __sub__(self, other: "Sums") -> "Sums":
        return Sums(
            self.residual - other.residual, self.torque - other.torque, self.rows - other.rows
        )

    def errors(self) -> Errors:
        """The sums as errors."""
        none = np.full(len(self.rows), np.nan)
        share = np.divide(self.residual, self.torque, out=none.copy(), where=self.torque > 0)
        mean = np.divide(self.residual, self.rows, out=none.copy(), where=self.rows > 0)
        return Errors(
            float(self.residual.sum() / self.rows.sum()),
            float(100 * np.sqrt(self.residual.sum() / (self.torque.sum() or np.nan))),
            100 * np.sqrt(share),
            np.sqrt(mean),
        )


def added(parts: Sequence[Sums]) -> Sums:
    """Several sums together."""
    return Sums(
        np.sum([p.residual for p in parts], axis=0),
        np.sum([p.torque for p in parts], axis=0),
        np.sum([p.rows for p in parts], axis=0),
    )


def sums(triangles: Array, counts: NDArray[np.int64], beta: Array) -> Sums:
    """Sums over triangles of any number of logs and stretches.

    Args:
        triangles: shape (..., n, b + 1, b + 1).
        counts: rows in each, shape (..., n).
        beta: shape (b,).
    """
    n = counts.shape[-1]
    return Sums(
        squared_error(triangles, beta).reshape(-1, n).sum(axis=0),
        squared_torque(triangles).reshape(-1, n).sum(axis=0),
        counts.reshape(-1, n).sum(axis=0),
    )
