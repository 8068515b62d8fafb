"""The one error that `ident run`, `ident validate` and `ident gap` tell of a model on a log.

||tau - tau of the model|| / ||tau|| over all joints, tau being the torque as recorded, that of
named effects included, both through the low-pass of the model's fit, in the counted periods, joints
left out while they are slower than the fit's threshold.
"""

from collections.abc import Sequence
from typing import Any

from ident.identification.identify import Identification
from ident.identification.validation import arm_of, predict
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset
from ident.regression.squared_errors import Errors, sums
from ident.workflows.run_json import errors_content
from wamctl.arm.errors import DataError


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


def _content(name: str, cutoff_hz: float, errors: Errors) -> dict[str, Any]:
    return {"name": name, "cutoff_hz": cutoff_hz} | errors_content(errors)
