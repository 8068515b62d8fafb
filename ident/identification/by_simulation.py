"""The base parameters once more, from simulated positions: output error in closed loop.

Regression asks which parameters explain the torque along the recorded motion, whose derivatives it
has to form; output error asks with which parameters the recorded torque would have moved the arm
as it moved. The columns of the one are torques, of the other positions; possible parameters are
then found in the same way, (32)-(36).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.estimation.feasible_sdp import feasible, nearest_to_cad
from ident.estimation.problem import Estimate, Problem, with_beta
from ident.identification.cross_validation import FOLD_MASKS, predicted_by
from ident.identification.identify import Identification
from ident.identification.prediction_error import assess
from ident.output_error.driven.begin import begun
from ident.output_error.driven.columns import DrivenArm
from ident.output_error.driven.fit import DrivenFit, covariance, fitted, floor_of, left_out
from ident.recordings.dataset import Dataset
from ident.regression.progress import Tell, silent
from ident.regression.reduction import block_of
from ident.signals.arrays import Array

_SAME = 2.0  # standard errors of a difference


@dataclass(frozen=True)
class BySimulation:
    """What simulation found where torque drives the arm.

    Attributes:
        found: the identification with simulation's estimates, errors, and predictions.
        regression: base parameters by regression, shape (b,).
        regression_sd: their standard errors, shape (b,).
        arm: arm and recordings, as simulated.
        fit: to all of them.
        held_out: rms of stretches that were not fitted [rad], shape (n,).
    """

    found: Identification
    regression: Array
    regression_sd: Array
    arm: DrivenArm
    fit: DrivenFit
    held_out: Array

    @property
    def apart(self) -> Array:
        """Differences of the methods in standard errors, shape (b,); NaN: not known."""
        known = np.isfinite(self.found.sd) & np.isfinite(self.regression_sd)
        sd = np.where(known, np.hypot(self.found.sd, self.regression_sd), np.nan)
        return np.abs(self.found.estimates["ols"].beta - self.regression) / sd

    @property
    def agreeing(self) -> tuple[int, int]:
        """How many base parameters are within two standard errors, of how many known ones."""
        apart = self.apart[np.isfinite(self.apart)]
        return int(np.sum(apart <= _SAME)), len(apart)


def by_simulation(found: Identification, tell: Tell = silent) -> BySimulation:
    """The identification of the same recordings by simulation.

    Args:
        found: that by regression, near which the search begins.
        tell: hears what is being done.

    Raises:
        DataError: recordings or friction that cannot be simulated, or no possible parameters.
    """
    evidence = found.evidence
    base, robot = evidence.base, evidence.arm.robot
    tell("simulating")
    chosen = found.estimates[found.chosen]
    delta = chosen.delta
    if delta is None:
        delta = with_beta(base, evidence.prior, chosen.beta)
    data = [log.data for log in evidence.logs]
    arm, beta, settings = begun(robot, evidence.arm.terms, base, delta, data)
    fit = fitted(arm, beta, settings, progress=partial(tell, "simulating"))
    tell("how well it is known")
    known = np.isfinite(found.sd)
    errors = np.linalg.cholesky(_sure(covariance(arm, fit)))
    errors[~known] = np.inf
    stretches = _stretches(arm, data)
    left, betas = left_out(arm, fit, np.argmax([m[stretches] for m in FOLD_MASKS], axis=0))
    estimates = {name: found.estimates[name] for name in ("cad",) if name in found.estimates}
    estimates["ols"] = Estimate(fit.beta, status="output error")
    estimates["feasible"] = _possible(found, arm, fit)
    if found.chosen not in estimates:
        estimates[found.chosen] = estimates["feasible"]
    held = {
        name: predicted_by(evidence, list(betas + e.beta - fit.beta) if name != "cad" else
                           [e.beta] * len(betas))
        for name, e in estimates.items()
    }  # fmt: skip
    again = replace(
        found,
        estimates=estimates,
        assessments={name: assess(evidence, e) for name, e in estimates.items()},
        held_out=held,
        errors=errors,
        sd=np.where(known, np.linalg.norm(errors, axis=1), np.inf),
    )
    rms = np.sqrt(np.mean(left**2, axis=0))
    return BySimulation(again, found.estimates["ols"].beta, found.sd, arm, fit, rms)


def _sure(cov: Array) -> Array:
    """The covariance, made definite against rounding."""
    scale = np.sqrt(np.diag(cov))
    return cov + 1e-9 * np.diag(scale**2)


def _possible(found: Identification, arm: DrivenArm, fit: DrivenFit) -> Estimate:
    """The possible parameters whose positions are nearest to the recorded ones, in first order."""
    evidence = found.evidence
    usual = np.maximum(fit.rms, floor_of(arm.setup))
    rows = (fit.columns / usual).reshape(len(fit.columns), -1)[: len(fit.beta)].T
    wanted = (fit.residuals / usual).ravel() + rows @ fit.beta
    R = np.asarray(np.linalg.qr(np.column_stack([rows, wanted]), mode="r"))
    sets = evidence.prior, evidence.sizes, evidence.constraints
    problem = Problem(evidence.base, R, len(rows), *sets)
    return nearest_to_cad(problem, feasible(problem))


def _stretches(arm: DrivenArm, data: Sequence[Dataset]) -> NDArray[np.int64]:
    """Stretch of its recording that each counted sample belongs to, shape (S,)."""
    spans = {d.name: d.span_s for d in data}
    return np.concatenate(
        [block_of(s.start_s + s.motion.t[s.counted :], spans[s.name]) for s in arm.setup.segments]
    )
