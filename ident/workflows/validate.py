"""The work of `ident validate`, from files to files."""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ident.checks.examine import OF_FITS, examine
from ident.checks.remark import (
    Grade,
    RefusedError,
    Remark,
    joints,
    numbers,
    verdict_content,
    verdict_of,
)
from ident.checks.settings import DEFAULT, CheckSettings
from ident.checks.torque import poorly_predicted
from ident.checks.urdf_faults.description import description_remarks
from ident.effects.bound_effects import load_model
from ident.effects.simulated_model import with_loads
from ident.identification.cross_validation import check_held_out
from ident.identification.validation import Prediction, arm_of, predict
from ident.model.arm import Arm
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset
from ident.recordings.loading import Reading, read_for
from ident.regression.progress import Tell, silent
from ident.regression.squared_errors import Errors
from ident.report.figures import validation_trace
from ident.report.page import render
from ident.report.validate_page import validate_page
from ident.signals.arrays import Array
from ident.workflows.run_json import errors_content, log_content, torque_units
from ident.workflows.work import provenance, write_refusal, write_results

_WORSE_THAN_NONE = 100.0
"""Error of a joint [%] from which a model without torque predicts better."""

_CLEARLY = 0.5
"""Share of that error below which it is the sign."""

_EXPLAINED = 70.0
"""Error [%] from which a model explains too little of a recording to tell its signs."""

_OF_LINKS = (
    "cad_disagrees",
    "current_not_torque",
    "driving_friction",
    "gravity_direction",
    "joint_order",
    "large_error",
    "positions",
    "sign",
    "units",
    "zero_pose",
)
"""Codes of what only the rigid links' dynamics say of a recording."""

_FAR = 3.0
"""Times the error of a recording's own fit, and of the model's recordings: another arm's model."""

_FAR_FROM = 5.0
"""Error [%] below which that is of no consequence."""

_ANOTHER_ARM = (
    "Check that the model belongs to this arm in its present state (tool, load, mounting, joint"
    " zeros, unit of the torque), or identify the arm again."
)
_RECORDING = (
    "Check this recording's torque, positions and stamps; if they are right, let `ident gap` search"
    " for a missing effect."
)


def validate_logs(
    paths: Sequence[Path],
    model_path: Path,
    out: Path,
    reading: Reading,
    tell: Tell = silent,
    **settings: Any,
) -> str:
    """Compare recordings with a model and write the errors; gives the content of `validate.json`.

    Args:
        paths: the logs.
        model_path: a `model.yaml`.
        out: folder for the results.
        reading: topics and torque to read.
        tell: hears what is being done.
        settings: fields of the filter that differ from the model's.

    Raises:
        RefusedError: recordings that say nothing; `validate.json` and the report say why.
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    model = load_model(model_path)
    arm = arm_of(model).with_settings(**settings)
    recorded = [read_for(arm, path, reading) for path in paths]
    data, remarks = checked(with_loads(arm, model), recorded)
    of_links = [r for r in remarks if r.code in _OF_LINKS]
    if of_links and predicts(model, arm, data, recorded):
        remarks = [r for r in remarks if r not in of_links]
    if verdict_of(remarks) is Grade.REFUSED:
        refusal = RefusedError(remarks)
        content = verdict_content(remarks) | {"arm": model.arm, "model": str(model_path)}
        write_refusal(out, "validate", refusal, content, model.arm)
        raise refusal
    predictions = []
    remarks = [r for r in remarks if not (r.code == "sign" and r.grade is Grade.DOUBTFUL)]
    for one, before in zip(data, recorded, strict=True):
        tell(f"predicting {Path(one.name).name}")
        prediction, told = with_signs_of_fit(model, arm, one, before)
        predictions.append(prediction)
        remarks += told
    remarks += large_errors(predictions, model)
    tell("writing the report")
    content = verdict_content(remarks) | {
        "arm": model.arm,
        "model": str(model_path),
        "fitted_on": list(model.logs),
        "estimator": model.estimator,
        "effects": [effect.name for effect in model.effects.records],
        "joints": list(model.robot.joint_names),
        "torque_units": torque_units(model.robot),
        "logs": [prediction_content(p, model.estimator) for p in predictions],
        "provenance": provenance(arm, paths),
        "seconds": {"total": time.perf_counter() - start},
    }
    traces = tuple(validation_trace(p, model.estimator) for p in predictions)
    page = render(validate_page(content, traces))
    return write_results(out, "validate", content, page)


def checked(arm: Arm, data: Sequence[Dataset]) -> tuple[list[Dataset], list[Remark]]:
    """Recordings with what could be mended mended, and what the checks found.

    Each is judged by itself; whether its motion would have told the parameters apart is no matter
    here, since nothing is fitted to it.
    """
    mended, remarks, of_arm = [], [], description_remarks(arm.robot)
    for one in data:
        examined = examine(arm, [one])
        mended += examined.data
        told = [r for r in examined.remarks if r.code not in OF_FITS]
        remarks += told if len(data) == 1 else [r if r in of_arm else _of(one, r) for r in told]
    return mended, list(dict.fromkeys(remarks))


def _of(data: Dataset, remark: Remark) -> Remark:
    """A remark with the name of its recording."""
    if remark.finding.startswith(data.name):
        return remark
    return replace(remark, finding=f"{data.name}: {remark.finding}")


def predicts(
    model: Model, arm: Arm, mended: Sequence[Dataset], recorded: Sequence[Dataset]
) -> bool:
    """Whether the model refutes what its arm's rigid links alone say against these recordings.

    An effect that the model holds, such as a spring, may look like a joint that counts the other
    way round.

    Args:
        model: what was fitted.
        arm: the model's.
        mended: the recordings as the checks leave them.
        recorded: as they were read.
    """
    if not model.effects.records:
        return False
    pairs = zip(mended, recorded, strict=True)
    found = [with_signs_of_fit(model, arm, *pair)[0].filtered[model.estimator] for pair in pairs]
    return max(e.relative_percent for e in found) < 100 * DEFAULT.error_doubtful


def with_signs_of_fit(
    model: Model, arm: Arm, mended: Dataset, recorded: Dataset
) -> tuple[Prediction, list[Remark]]:
    """The prediction of one recording whose torques count as they did in the model's fit.

    Whether a torque counts the other way round is asked of the model: what the recording alone says
    of it (friction that drives) may be said of one recording of an arm, and not of the next.

    Args:
        model: what was fitted.
        arm: the model's.
        mended: the recording as the checks leave it.
        recorded: as it was read.
    """
    pairs = zip(mended.read(), recorded.read(), strict=True)
    turned = np.sum([np.sum(a.tau * b.tau, axis=0) for (_, a), (_, b) in pairs], axis=0)
    upright = mended.with_torque_times(np.where(turned < 0, -1.0, 1.0))
    found = predict(model, arm, upright)
    errors = found.filtered[model.estimator].relative_percent_by_joint
    if not (errors > _WORSE_THAN_NONE).any():
        return found, []
    other = predict(model, arm, upright.with_torque_times(-np.ones(len(errors))))
    against = other.filtered[model.estimator].relative_percent_by_joint
    inverted = against < _CLEARLY * errors
    if not inverted.any():
        return found, []
    if not (errors < _CLEARLY * against).any():  # a joint that does not tell is as the others are
        inverted = np.isfinite(errors)
    turned = predict(model, arm, upright.with_torque_times(np.where(inverted, -1.0, 1.0)))
    if turned.filtered[model.estimator].relative_percent > _EXPLAINED:
        return found, []
    places = np.flatnonzero(inverted)
    text = (
        f"{mended.name}: the torque of {joints(places, model.robot.joint_names)} has the other sign"
        " than the model's, and was inverted (where the fit inverted its recordings' torque, too,"
        " both were recorded alike)."
    )
    advice = "Correct the sign where the torque is recorded."
    remark = Remark("sign", numbers(places), text, Grade.DOUBTFUL, advice)
    return turned, [remark]


def large_errors(
    predictions: Sequence[Prediction], model: Model, bounds: CheckSettings = DEFAULT
) -> list[Remark]:
    """Recordings, and joints, that the model does not predict, or far worse than it could."""
    found = []
    for one in predictions:
        errors, name = one.filtered[model.estimator], one.evidence.logs[0].data.name
        left, own = errors.relative_percent, _own_percent(one, errors)
        large, far = left > 100 * bounds.error_doubtful, left > max(_FAR_FROM, _FAR * own)
        far = far and _size(errors) > _FAR * _norm(model.noise)
        robot, shares = one.evidence.arm.robot, errors.relative_percent_by_joint / 100
        joints = robot.joint_names, torque_units(robot)
        at_joints = poorly_predicted(shares, errors.rms_by_joint, *joints, bounds, name)
        if not large and (at_joints or not far):
            found += at_joints
            continue
        noisy = not far and 100 * bounds.error_doubtful < own < np.inf
        text = f"{name}: the model leaves {left:.3g} % of the torque unexplained"
        text += f"; a fit of this recording alone leaves {own:.3g} %." if far or noisy else "."
        advice = _RECORDING if noisy else _ANOTHER_ARM
        found.append(Remark("large_error", (), text, Grade.DOUBTFUL, advice))
    return found


def _own_percent(one: Prediction, errors: Errors) -> float:
    """What a rigid arm that is fitted to a recording leaves of its torque, on held-out parts [%].

    In proportion to the model's own error, in whose torque that of effects counts as well.
    """
    own = check_held_out(one.evidence, ["ols"])["ols"].errors
    share = _size(own) / (_size(errors) or np.nan)
    return errors.relative_percent * share if np.isfinite(share) else np.inf


def _size(errors: Errors) -> float:
    return _norm(errors.rms_by_joint)


def _norm(values: Array) -> float:
    return float(np.sqrt(np.nansum(values**2)))


def prediction_content(prediction: Prediction, chosen: str) -> dict[str, Any]:
    """Errors of a model on one recording, as `validate.json` holds them."""
    log = prediction.evidence.logs[0]
    errors = {
        name: errors_content(prediction.filtered[name])
        | {
            "relative_error_percent_sd": prediction.sd_percent[name],
            "raw_torque": errors_content(prediction.raw[name]),
        }
        for name in prediction.betas
    }
    return log_content(log) | errors[chosen] | {"estimators": errors}
