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

WORSE = 1.05
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
) -> tuple[list[float], list[float]] | None:
    """Errors of a model with effects beside those of one without [%], where they are larger.

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
    pair = [with_effects[name] for name in names], [without[name] for name in names]
    return pair if sum(pair[0]) > WORSE * sum(pair[1]) else None


def withheld_names(worse: tuple[list[float], list[float]]) -> Remark:
    """What is said where nothing is named, since the arm explains less beside what was found.

    Args:
        worse: errors with it, and without [%].
    """
    text = (
        "Beside what the search found, the model explains the recordings worse than that of `ident"
        f" run` does without it: it leaves {_beside(worse)}. So nothing is named."
    )
    advice = (
        "Check the stamps and the samples that the recorder lost: their faults look like delays,"
        " contacts and offsets."
    )
    return Remark("large_error", (), text, Grade.DOUBTFUL, advice)


def worse_reference(worse: tuple[list[float], list[float]]) -> Remark:
    """What is said of a reference model that explains less than one fitted to the recordings.

    Args:
        worse: errors of the reference model with its effects, and of the other one [%].
    """
    text = (
        "The reference model with these effects explains the recordings worse than a model that is"
        f" fitted to them does without effects: it leaves {_beside(worse)}. What is named is not"
        " all that has changed."
    )
    advice = "Check that the reference model is of this arm, or search without it."
    return Remark("large_error", (), text, Grade.DOUBTFUL, advice)


def _beside(worse: tuple[list[float], list[float]]) -> str:
    return listed([f"{a:.3g} instead of {b:.3g} %" for a, b in zip(*worse, strict=True)])


def _content(name: str, cutoff_hz: float, errors: Errors) -> dict[str, Any]:
    return {"name": name, "cutoff_hz": cutoff_hz} | errors_content(errors)
