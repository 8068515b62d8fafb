"""How well a model predicts recordings that it was not fitted on."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.smoothed_segment import MOTION_HZ
from ident.estimation.regression_data import RegressionData, reduce_recordings
from ident.estimation.reversal_shapes import KnownShapes
from ident.identification.cross_validation import spread
from ident.model.arm import TERM_NAMES, Arm
from ident.model.fit_filter import Filter
from ident.model.identified_model import Model, NoEffects
from ident.recordings.dataset import Dataset
from ident.recordings.torque_timing import with_torque_later
from ident.regression.filters import Processing
from ident.regression.squared_errors import Errors, Sums, sums
from ident.signals.arrays import Array
from wamctl.arm.config import IdentificationSection
from wamctl.arm.errors import DataError


@dataclass(frozen=True)
class Prediction:
    """One recording against a model.

    Attributes:
        evidence: the recording, reduced.
        betas: base parameters by estimator, each of shape (b,).
        filtered: errors on filtered torque, by estimator.
        raw: errors on torque as recorded, by estimator.
        sd_percent: standard error of the relative error on filtered torque, by estimator [%].
    """

    evidence: RegressionData
    betas: Mapping[str, Array]
    filtered: dict[str, Errors]
    raw: dict[str, Errors]
    sd_percent: dict[str, float]


def fit_filter(process: Processing, known: KnownShapes | None) -> Filter:
    """What a model keeps of the filters of its fit.

    Args:
        process: the filters.
        known: how friction turns round; None: at once.
    """
    return Filter(
        cutoff_hz=process.cutoff_hz,
        order=process.motion.order,
        differentiation_cutoff_hz=process.motion.cutoff_hz,
        sign_cutoff_hz=process.sign.cutoff_hz,
        parallel=process.columns is not None,
        velocity_threshold_rad_s=process.threshold_rad_s,
        reversals=() if known is None or not process.curves else known.for_model(),
        delay_s=process.delay_s,
    )


def arm_of(model: Model) -> Arm:
    """The arm as the model has it, with the filter of its fit."""
    filter_ = model.filter
    settings = IdentificationSection(
        cutoff_hz=filter_.cutoff_hz,
        filter_order=filter_.order,
        filter_torque=filter_.parallel,
        differentiation_cutoff_hz=filter_.differentiation_cutoff_hz,
        sign_cutoff_hz=filter_.sign_cutoff_hz,
        velocity_threshold_rad_s=filter_.velocity_threshold_rad_s,
        reversals="auto" if filter_.reversals else "culled",
        delay_s=filter_.delay_s or None,
        torque_unit="A" if model.gains_nm_per_a else "N m",
        gains_nm_per_a=model.gains_nm_per_a or None,
    )
    terms = [name for name in TERM_NAMES if getattr(model.terms, name)]
    arm = Arm(model.arm, model.robot, settings, model.terms, None, "model.yaml")
    return arm.with_settings(terms=terms)


def refuse_unseen(model: Model, data: Dataset) -> None:
    """Refuse a recording of which the model says nothing.

    Raises:
        DataError: the recording moves joints that the model has not seen moving.
    """
    unseen = data.moving & ~model.moving
    if unseen.any():
        names = ", ".join(np.array(model.robot.joint_names)[unseen])
        raise DataError(
            f"{data.name} moves {names}, held in the recordings that the model was fitted on:"
            " fit recordings that move it as well, or give one that does not."
        )


def on_time(data: Dataset, arm: Arm) -> tuple[Dataset, Arm]:
    """A recording whose torque acts when its stamps say, and the arm without that delay.

    For what looks at torque and motion before the regression, which has the delay itself.
    """
    seconds = arm.settings.delay_s
    if not seconds:
        return data, arm
    return with_torque_later(data, seconds), arm.with_settings(delay_s=0.0)


def with_delay(model: Model, seconds: float | None) -> Model:
    """A model that was fitted to torque on time, for recordings whose torque acts later [s]."""
    return replace(model, filter=replace(model.filter, delay_s=seconds or 0.0))


def predict(model: Model, arm: Arm, data: Dataset) -> Prediction:
    """The model's errors on one recording, with the effects that the model holds.

    The torque of the chosen parameters can be predicted for any motion of the joints that moved in
    the fit; that of the other estimators only where the recording moves the same ones.

    Args:
        model: what `ident run` found.
        arm: the model's arm, perhaps with another filter.
        data: the recording.

    Raises:
        DataError: the recording moves joints that the model has not seen moving.
    """
    refuse_unseen(model, data)
    known = KnownShapes.of_model(model.filter.reversals) if model.filter.reversals else None
    evidence = whole = slow = reduce_recordings([data], arm, known=known)
    if model.effects.records:
        from ident.effects.compensation import without_effects  # it loads numba, half a second

        cutoff = evidence.logs[0].process.cutoff_hz  # of the links' motion beside unfiltered torque
        data, arm = on_time(data, arm)
        ways = (replace(model, effects=NoEffects()), MOTION_HZ), (model, MOTION_HZ), (model, cutoff)
        whole, evidence, slow = (
            reduce_recordings([without_effects(m, data, hz)], arm, known=known) for m, hz in ways
        )
    betas: Mapping[str, Array] = {model.estimator: evidence.base.K @ model.delta}
    if evidence.base.names == tuple(b.name for b in model.base_parameters):
        betas = _all_betas(model)
    log, torque = evidence.logs[0].reduction, whole.logs[0].reduction
    filtered = {n: _sums(log.R, log.count, beta, torque.R).errors() for n, beta in betas.items()}
    rows = log.count.sum(axis=0)
    R_raw = slow.logs[0].reduction.R_raw
    raw = {n: _sums(R_raw, rows, beta, torque.R_raw).errors() for n, beta in betas.items()}
    filled = np.flatnonzero(log.count.any(axis=1))
    sd = {
        n: spread([_sums(log.R[b], log.count[b], beta, torque.R[b]) for b in filled])
        for n, beta in betas.items()
    }
    return Prediction(evidence, betas, filtered, raw, sd)


def _sums(R: Array, count: NDArray[np.int64], beta: Array, whole: Array) -> Sums:
    """Squared errors beside the squares of the whole torque, that of the effects included."""
    return replace(sums(R, count, beta), torque=sums(whole, count, beta).torque)


def _all_betas(model: Model) -> Mapping[str, Array]:
    """Base parameters by estimator; CAD's unknown friction is zero."""
    names = dict.fromkeys(n for b in model.base_parameters for n in b.values)
    return {n: np.array([b.values.get(n, 0.0) for b in model.base_parameters]) for n in names}
