"""How well base parameters explain rows, and whether an arm can have them."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.feasible_set import smallest_eigenvalue
from ident.estimation.problem import Estimate, with_beta
from ident.estimation.regression_data import RegressionData
from ident.identification.feasibility_test import positive_fraction, proves_possible, verdict
from ident.regression.squared_errors import Errors, sums
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Assessment:
    """One estimate, judged.

    Attributes:
        filtered: errors on the rows of the fit.
        raw: errors on the same instants before the last filter.
        feasible: whether a possible arm has these parameters.
        smallest_eigenvalue: of the pseudo-inertias of the best such arm.
        negative: names of negative friction parameters.
        positive_fraction: share of random postures with a positive mass matrix.
    """

    filtered: Errors
    raw: Errors
    feasible: bool
    smallest_eigenvalue: float
    negative: tuple[str, ...]
    positive_fraction: float


def assess(evidence: RegressionData, estimate: Estimate) -> Assessment:
    """The estimate on all rows of the fit, and its feasibility."""
    base, arm = evidence.base, evidence.arm
    raw = np.stack([log.reduction.R_raw for log in evidence.logs])
    counts = evidence.counts.sum(axis=1)
    found = verdict(base, estimate.beta, evidence.prior, evidence.sizes)
    delta = with_beta(base, _with_masses(evidence), estimate.beta)
    witnesses, own = [found.smallest_eigenvalue], False
    if estimate.delta is not None:
        witnesses.append(smallest_eigenvalue(estimate.delta, base.parameters))
        own = proves_possible(estimate.delta, base)  # on the boundary the test's margin is rounding
    return Assessment(
        filtered=sums(evidence.triangles, evidence.counts, estimate.beta).errors(),
        raw=sums(raw, counts, estimate.beta).errors(),
        feasible=found.feasible or own,
        smallest_eigenvalue=max(witnesses),
        negative=found.negative,
        positive_fraction=positive_fraction(arm.robot, arm.terms, base, delta, evidence.moving),
    )


def _with_masses(evidence: RegressionData) -> Array:
    """The prior with a mass for every link, which Pinocchio asks for."""
    masses = [
        evidence.sizes[p.index].mass if p.kind == "inertial" and p.unit == "kg" else value
        for p, value in zip(evidence.base.parameters, evidence.prior, strict=True)
    ]
    return np.array(masses)
