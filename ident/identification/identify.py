"""From recordings to an identified arm: section V of the paper, in its order."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ident.estimation.feasible_sdp import nearest_to_cad
from ident.estimation.least_squares import ESTIMATORS, wanted_estimators
from ident.estimation.problem import Estimate, with_beta
from ident.estimation.regression_data import RegressionData, reduce_recordings
from ident.estimation.reversal_shapes import KnownShapes
from ident.identification.cross_validation import HeldOut, check_held_out
from ident.identification.identifiability import Identifiability, identifiability
from ident.identification.prediction_error import Assessment, assess
from ident.identification.standard_errors import joint_errors
from ident.identification.term_selection import Trial, with_needed_terms
from ident.identification.torque_delay import Delay, delay
from ident.identification.validation import fit_filter
from ident.identification.velocity_threshold import Sweep, sweep
from ident.model.arm import Arm
from ident.model.identified_model import Model
from ident.model.records import BaseParameter
from ident.recordings.dataset import Dataset
from ident.regression.progress import Tell, silent
from ident.regression.triangles import condition_number
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Identification:
    """All that a run found.

    Attributes:
        evidence: the reduced recordings.
        estimates: by estimator.
        assessments: by estimator.
        held_out: by estimator.
        sd: standard error of each OLS base parameter, shape (b,).
        errors: the fit's part of it, as a root of the covariance, shape (b, k).
        condition_number: of W.
        sweep: what velocity culling does.
        delays: of each recording.
        limits: what could not be identified.
        trials: terms that were tried, where the settings ask for it.
        seconds: time spent by step [s].
    """

    evidence: RegressionData
    estimates: dict[str, Estimate]
    assessments: dict[str, Assessment]
    held_out: dict[str, HeldOut]
    sd: Array
    errors: Array
    condition_number: float
    sweep: Sweep
    delays: tuple[Delay, ...]
    limits: Identifiability
    trials: tuple[Trial, ...]
    seconds: dict[str, float]

    @property
    def chosen(self) -> str:
        """The estimator whose parameters become the model."""
        return self.evidence.arm.settings.estimator


def identify(data: Sequence[Dataset], arm: Arm, tell: Tell = silent) -> Identification:
    """Identify an arm.

    Args:
        data: the recordings, joints in the robot's order.
        arm: the robot and its settings.
        tell: hears what is being done.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    start = time.perf_counter()
    evidence, trials = with_needed_terms(data, arm, tell)
    arm = evidence.arm
    culling = sweep([log.reduction.excerpt_at_once for log in evidence.logs])
    if arm.settings.velocity_threshold_rad_s == "auto":
        culled = arm.with_settings(velocity_threshold_rad_s=culling.choice)
        evidence = reduce_recordings(data, culled, partial(tell, "leaving out slow samples"))
    tell("fitting, and predicting what was not fitted")
    formed = time.perf_counter()
    regressor = sum(log.reduction.regressor_s for log in evidence.logs)
    names = wanted_estimators(evidence)
    estimates = {name: ESTIMATORS[name](evidence) for name in names}
    chosen = arm.settings.estimator
    estimates[chosen] = nearest_to_cad(evidence.problem(), estimates[chosen])
    problem, errors = evidence.problem(), joint_errors(evidence)
    sd = np.linalg.norm(errors, axis=1)
    return Identification(
        evidence=evidence,
        estimates=estimates,
        assessments={name: assess(evidence, estimate) for name, estimate in estimates.items()},
        held_out=check_held_out(evidence, names),
        sd=sd,
        errors=errors,
        condition_number=condition_number(problem.R),
        sweep=culling,
        delays=tuple(delay(log) for log in evidence.logs),
        limits=identifiability(evidence.base, problem.R, estimates["ols"].beta, sd),
        trials=trials,
        seconds={
            "filter": formed - start - regressor,
            "regressor": regressor,
            "solve": time.perf_counter() - formed,
        },
    )


def model_of(found: Identification) -> Model:
    """The model that `model.yaml` keeps."""
    evidence, name = found.evidence, found.chosen
    chosen = found.estimates[name]
    process = evidence.logs[0].process
    delta = chosen.delta
    if delta is None:
        delta = with_beta(evidence.base, evidence.prior, chosen.beta)
    errors = np.zeros((len(delta), found.errors.shape[1]))
    errors[list(evidence.base.kept)] = found.errors
    return Model(
        arm=evidence.arm.name,
        estimator=name,
        robot=evidence.arm.robot,
        terms=evidence.arm.terms,
        delta=delta,
        moving=evidence.moving,
        base_parameters=_table(found),
        errors=errors,
        filter=fit_filter(process, KnownShapes(process.curves, evidence.reversals.shapes)),
        noise=_error(found, name),
        logs=tuple(log.data.name for log in evidence.logs),
        gains_nm_per_a=evidence.arm.settings.gains_nm_per_a or (),
    )


def _error(found: Identification, name: str) -> Array:
    """Of the torque of motions that were not fitted [N m], shape (n,)."""
    fitted = found.assessments[name].filtered.rms_by_joint
    return np.fmax(fitted, found.held_out[name].errors.rms_by_joint)


def _table(found: Identification) -> tuple[BaseParameter, ...]:
    base = found.evidence.base
    rows = []
    for i, (name, unit) in enumerate(zip(base.names, base.units, strict=True)):
        values = {
            estimator: float(estimate.beta[i])
            for estimator, estimate in found.estimates.items()
            if estimator != "cad" or base.kept_parameters[i].kind == "inertial"
        }
        rows.append(BaseParameter(name, unit, values, float(found.sd[i])))
    return tuple(rows)
