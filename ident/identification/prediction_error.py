"""How well base parameters explain rows, and whether an arm can have them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.estimation.feasible_set import smallest_eigenvalue
from ident.estimation.problem import Estimate, with_beta
from ident.estimation.regression_data import Evidence
from ident.identification.feasibility_test import positive_fraction, verdict
from ident.regression.reduction import squared_error, squared_torque

Array = NDArray[np.floating]


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
class Assessment:
    """One estimate, judged.

    Attributes:
        filtered: errors on the rows of the fit.
        raw: errors on the same instants before the last filter.
        feasible: whether a possible arm has these parameters.
        smallest_eigenvalue: of the pseudo-inertias of the best such arm.
        negative: names of negative friction parameters.
        culprits: base parameters that weigh most in the proof of impossibility.
        positive_fraction: share of random postures with a positive mass matrix.
    """

    filtered: Errors
    raw: Errors
    feasible: bool
    smallest_eigenvalue: float
    negative: tuple[str, ...]
    culprits: tuple[str, ...]
    positive_fraction: float


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
            float(100 * np.sqrt(self.residual.sum() / self.torque.sum())),
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


def assess(evidence: Evidence, estimate: Estimate) -> Assessment:
    """The estimate on all rows of the fit, and its feasibility."""
    base, arm = evidence.base, evidence.arm
    raw = np.stack([log.reduction.R_raw for log in evidence.logs])
    counts = evidence.counts.sum(axis=1)
    found = verdict(base, estimate.beta, evidence.prior, evidence.sizes)
    delta = with_beta(base, _with_masses(evidence), estimate.beta)
    order = np.argsort(-np.abs(found.certificate))[:3]
    witnesses = [found.smallest_eigenvalue]
    if estimate.delta is not None:
        witnesses.append(smallest_eigenvalue(estimate.delta, base.parameters))
    return Assessment(
        filtered=sums(evidence.triangles, evidence.counts, estimate.beta).errors(),
        raw=sums(raw, counts, estimate.beta).errors(),
        feasible=found.feasible,
        smallest_eigenvalue=max(witnesses),
        negative=found.negative,
        culprits=tuple(base.names[i] for i in order if found.certificate[i] != 0),
        positive_fraction=positive_fraction(arm.robot, arm.terms, base, delta, evidence.moving),
    )


def _with_masses(evidence: Evidence) -> Array:
    """The prior with a mass for every link, which Pinocchio asks for."""
    masses = [
        evidence.sizes[p.index].mass if p.kind == "inertial" and p.unit == "kg" else value
        for p, value in zip(evidence.base.parameters, evidence.prior, strict=True)
    ]
    return np.array(masses)
