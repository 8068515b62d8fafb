"""The one error that `ident run`, `ident validate` and `ident gap` tell of a model on a log.

||tau - tau of the model|| / ||tau|| over all joints, both through the low-pass of the model's fit,
in the counted periods, joints left out while they are slower than the fit's threshold.
"""

from typing import Any

from ident.gap.data.experiment import Experiment
from ident.identification.validation import arm_of, predict
from ident.model.identified_model import Model
from ident.recordings.steady_state import only_steady_state
from ident.workflows.run_json import errors_content


def model_errors(source: Experiment, model: Model) -> list[dict[str, Any]]:
    """The error of a model on each recording, as `ident validate` has it."""
    arm = arm_of(model)
    found = []
    for data, recording in zip(source.datasets, source.recordings, strict=True):
        counted = only_steady_state(data, recording, data.name)
        errors = predict(model, arm, counted).filtered[model.estimator]
        found.append(
            {"name": data.name, "cutoff_hz": model.filter.cutoff_hz} | errors_content(errors)
        )
    return found
