"""A log as what it says of the parameters: information and score, of a linear model with noise.

Days differ: friction scatters from one log to the next by more than noise explains. With this
scatter u ~ N(0, Q) integrated out, a log with inner products N = X^T S^-1 X and y = X^T S^-1 tau
says N (1 + Q N)^-1 and (1 + N Q)^-1 y, and logs add up again (Woodbury).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ident.fleet.triangles import JointTriangle
from ident.signals.arrays import Array


@dataclass(frozen=True)
class LogData:
    """One log's triangles with what else the statistics ask of it.

    Attributes:
        joints: the triangles.
        rows: number of rows of each joint, n of them.
        rows_per_value: of the log's filter.
        warmer_k: temperature beside the type's reference [K]; zero where it is not known.
        louder: noise of its arm beside that of the type, of each joint, shape (n,).
    """

    joints: Sequence[JointTriangle]
    rows: Sequence[int]
    rows_per_value: float
    warmer_k: float = 0.0
    louder: Array | None = None

    @property
    def squares(self) -> Array:
        """Of what its own fit leaves of each joint's torque, the sum [N^2 m^2], shape (n,)."""
        found = np.zeros(len(self.rows))
        for t in self.joints:
            found[t.joint] = t.R[-1, -1] ** 2
        return found

    def times(self, noise: Array) -> Array:
        """The type's noise [N m] as that of this log's arm, shape (n,)."""
        return noise if self.louder is None else noise * self.louder


@dataclass(frozen=True)
class Information:
    """What one or several logs say of p parameters: precision N and N times the best value."""

    N: Array
    y: Array

    def __add__(self, other: "Information") -> "Information":
        """What both say."""
        return Information(self.N + other.N, self.y + other.y)


def nothing(count: int) -> Information:
    """What no log says."""
    return Information(np.zeros((count, count)), np.zeros(count))


def information(log: LogData, noise: Array, count: int) -> Information:
    """What a log says with independent noise alone.

    Args:
        log: the log.
        noise: of each joint's torque after the low-pass in the type [N m], shape (n,).
        count: number of columns p.
    """
    gram, noise = np.zeros((count + 1, count + 1)), log.times(noise)
    for t in log.joints:
        gram[np.ix_(t.used, t.used)] += t.R.T @ t.R / (noise[t.joint] ** 2 * log.rows_per_value)
    return Information(gram[:-1, :-1], gram[:-1, -1])


def without_scatter(log: Information, places: Sequence[int], Q: Array) -> Information:
    """What a log says with the scatter of days integrated out.

    Args:
        log: with noise alone.
        places: of the parameters that scatter, f of them.
        Q: their variances, shape (f,).
    """
    across = log.N[:, places]
    factor = scipy.linalg.cho_factor(across[places] + np.diag(1.0 / Q), lower=True)
    taken = scipy.linalg.cho_solve(factor, np.column_stack([across.T, log.y[places]]))
    return Information(log.N - across @ taken[:, :-1], log.y - across @ taken[:, -1])


def at_reference(log: Information, factors: Array) -> Information:
    """What a log says of the parameters that its own ones are multiples of.

    Args:
        log: what it says of its own parameters.
        factors: these beside those at the reference temperature, shape (p,).
    """
    return Information(factors[:, None] * log.N * factors, factors * log.y)


def posterior(data: Information, mean: Array, variance: Array) -> tuple[Array, Array]:
    """Mean, shape (p,), and covariance, shape (p, p), after the data.

    Args:
        data: what is known of the parameters.
        mean: before them, shape (p,).
        variance: before them, shape (p,).
    """
    scale = np.sqrt(variance)
    inner = scale[:, None] * data.N * scale + np.eye(len(scale))
    factor = scipy.linalg.cho_factor(inner, lower=True)
    moved = scale * scipy.linalg.cho_solve(factor, scale * (data.y - data.N @ mean))
    covariance = scale[:, None] * scipy.linalg.cho_solve(factor, np.diag(scale))
    return mean + moved, covariance
