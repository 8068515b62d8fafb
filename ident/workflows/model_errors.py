"""The one error that `ident run`, `ident validate` and `ident gap` tell of a model on a log.

||tau - tau of the model|| / ||tau|| over all joints, tau being the torque as recorded, that of
named effects included, both through the low-pass of the model's fit, in the counted periods, joints
left out while they are slower than the fit's threshold.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from ident.checks.remark import Grade, Remark
from ident.identification.identify import Identification
from ident.identification.validation import arm_of, predict
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset
from ident.regression.squared_errors import Errors, sums
from ident.workflows.run_json import errors_content
from wamctl.arm.errors import DataError
from wamctl.arm.joint_labels import listed

_WORSE = 1.05
"""Times the error of `ident run`'s model, from which a model's is told as larger."""


def errors_on(model: Model, data: Sequence[Dataset]) -> list[dict[str, Any]]:
    """The error of a model on recordings in their counted periods.

    Those are left out that are too short to say what the model's effects do in them: the result
    must not be lost for that.
    """
    arm, told = arm_of(model), []
    for d in data:
        try:
            errors = predict(model, arm, d).filtered[model.estimator]
        except DataError:
            continue
        told.append(_content(d.name, model.filter.cutoff_hz, errors))
    return told


def errors_of_fit(found: Identification) -> list[dict[str, Any]]:
    """The same for a fit without effects, from its own rows."""
    beta = found.estimates[found.chosen].beta
    return [
        _content(
            log.data.name,
            log.process.cutoff_hz,
            sums(log.reduction.R, log.reduction.count, beta).errors(),
        )
        for log in found.evidence.logs
    ]


def worse_than_run(
    told: Sequence[Mapping[str, Any]], run: Model, data: Sequence[Dataset]
) -> list[Remark]:
    """What is said of effects beside which the arm explains its own recordings worse.

    Effects are named on windows of the motion; what is a fault of the record (stamps, lost samples)
    may look like one there, and spoil the rest.

    Args:
        told: errors of the model with its effects, see `errors_on`.
        run: the model that `ident run` fits to the same recordings.
        data: the recordings.
    """
    with_effects, without = (
        {e["name"]: float(e["relative_error_percent"]) for e in errors}
        for errors in (told, errors_on(run, data))
    )
    names = [name for name in with_effects if name in without]
    pairs = [(with_effects[name], without[name]) for name in names]
    if not pairs or sum(a for a, _ in pairs) <= _WORSE * sum(b for _, b in pairs):
        return []
    beside = listed([f"{a:.3g} instead of {b:.3g} %" for a, b in pairs])
    text = (
        f"The model with these effects explains the recordings that were searched worse than that"
        f" of `ident run`: it leaves {beside}. What is named, or held without a name, is not what"
        " the arm has."
    )
    advice = (
        "Use the model of `ident run`, and check the stamps and the samples that the recorder lost:"
        " their faults look like delays, contacts and offsets."
    )
    return [Remark("large_error", (), text, Grade.DOUBTFUL, advice)]


def _content(name: str, cutoff_hz: float, errors: Errors) -> dict[str, Any]:
    return {"name": name, "cutoff_hz": cutoff_hz} | errors_content(errors)
