"""The estimators: each takes the evidence and gives an estimate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ident.estimation.entropic import entropic_path
from ident.estimation.feasible_sdp import feasible, holds
from ident.estimation.instrumental_variables import bias_test, instrumental_solution, joined
from ident.estimation.problem import Estimate, Problem, ordinary, solved
from ident.estimation.regression_data import FOLDS, RegressionData, held_out, noise_weights
from ident.regression.squared_errors import sums
from ident.signals.arrays import Array
from wamctl.arm.errors import ConfigurationError, DataError

Estimator = Callable[[RegressionData], Estimate]

_CAD_WEIGHTS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)

ALWAYS = ("cad", "ols", "wls", "feasible")
"""Estimators that every run compares."""

_HUBER = 1.345
_SIGMA_OF_MEDIAN = 1.4826
_ROUNDS = 30
_CHANGE = 1e-4


def cad(evidence: RegressionData) -> Estimate:
    """The CAD model, whose friction is unknown and left out."""
    return Estimate(evidence.base.K @ evidence.prior, evidence.prior)


def ols(evidence: RegressionData) -> Estimate:
    """Ordinary least squares (16)."""
    return Estimate(ordinary(evidence.problem()))


def wls(evidence: RegressionData) -> Estimate:
    """Least squares with each log's and joint's rows in units of its noise."""
    return Estimate(ordinary(evidence.problem(noise_weights(evidence))))


def instrumental_variables(evidence: RegressionData) -> Estimate:
    """The reference motion as instrument (IDIM-IV), with a test whether noise biased OLS."""
    found = joined([log.moments for log in evidence.logs if log.moments])
    test = bias_test(found)
    words = "is biased" if test.biased else "shows no bias"
    note = f"OLS {words} by noise in the position: |z| = {test.largest:.1f}, bound {test.bound:.1f}"
    return Estimate(instrumental_solution(found), note=note)


def feasible_least_squares(evidence: RegressionData) -> Estimate:
    """Feasible least squares (44), by the solver that the settings name.

    Where ours finds no possible parameters, those of the entropic fit are told, which needs none.
    """
    solver = evidence.arm.settings.solver
    if solver == "direct":
        try:
            return feasible(evidence.problem())
        except DataError as error:
            return _entropic_instead(evidence, error)
    try:
        from ident.estimation.readable_sdp import feasible_program  # cvxpy is an extra, and slow
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            "--solver",
            [f"{solver} needs cvxpy, which is not installed: pip install 'wam-ident[cvxpy]'"],
        ) from error
    estimate = feasible_program(evidence.problem()).solve(solver)
    if estimate.delta is None or not holds(evidence.problem().constraints, estimate.delta):
        raise DataError(
            f"{solver} ends outside of what is physically possible; --solver direct does not."
        )
    return estimate


def _entropic_instead(evidence: RegressionData, failure: DataError) -> Estimate:
    try:
        found = feasible_entropic(evidence)
    except DataError:
        raise failure from None
    reason = str(failure).rstrip(".")
    return replace(found, note=f"{reason}: the links are those of an entropic fit.")


def feasible_wls(evidence: RegressionData) -> Estimate:
    """Feasible least squares with rows in units of their noise."""
    return feasible(evidence.problem(noise_weights(evidence)))


def feasible_cad(evidence: RegressionData) -> Estimate:
    """Feasible least squares with a squared distance to CAD, weighted by cross-validation."""
    return _best_prior(evidence, _cad_path)


def feasible_entropic(evidence: RegressionData) -> Estimate:
    """Feasible least squares with an entropic distance to CAD, weighted by cross-validation."""
    return _best_prior(evidence, entropic_path)


def _cad_path(problem: Problem) -> list[Estimate]:
    return [feasible(problem, weight) for weight in _CAD_WEIGHTS]


def _best_prior(evidence: RegressionData, path: Callable[[Problem], list[Estimate]]) -> Estimate:
    """The estimate of that weight whose fits predict left-out stretches best."""
    errors = []
    for fold in range(FOLDS):
        out = held_out(fold)
        test = evidence.only(out)
        estimates = path(evidence.only(~out).problem())
        left = [sums(test.triangles, test.counts, e.beta).residual for e in estimates]
        errors.append([float(squares.sum()) for squares in left])
    final = path(evidence.problem())
    common = min(len(final), *map(len, errors))
    return final[int(np.argmin(np.sum([e[:common] for e in errors], axis=0)))]


def irls(evidence: RegressionData) -> Estimate:
    """Least squares that outliers cannot pull: full weight up to 1.345 sigma of each log and joint.

    Huber's weights, found anew until the estimate settles. Works on the excerpts, since single
    rows need single weights.
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


ESTIMATORS: dict[str, Estimator] = {
    "cad": cad,
    "ols": ols,
    "wls": wls,
    "irls": irls,
    "iv": instrumental_variables,
    "feasible": feasible_least_squares,
    "feasible_wls": feasible_wls,
    "feasible_cad": feasible_cad,
    "feasible_entropic": feasible_entropic,
}


def wanted_estimators(evidence: RegressionData) -> list[str]:
    """Names of the estimators to run, in the order of `ESTIMATORS`; cad only where there is one."""
    settings = evidence.arm.settings
    wanted = {*ALWAYS, *settings.estimators, settings.estimator}
    if not evidence.prior.any():
        wanted.remove("cad")
    return [name for name in ESTIMATORS if name in wanted]
