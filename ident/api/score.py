"""How well a model predicts recordings."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np

from ident.api.inputs import recorded
from ident.api.recording import Recording
from ident.identification.validation import arm_of, predict
from ident.model.identified_model import Model
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.signals.arrays import Array

if TYPE_CHECKING:
    from ident.output_error.servo_model import ServoModel


@dataclass(frozen=True)
class Score:
    """The error of predicted torque on one recording.

    Attributes:
        name: the recording.
        relative_error_percent: ||measured - predicted|| / ||measured|| over all joints [%].
        sd_percent: its standard error [%].
        relative_error_percent_by_joint: the same per joint [%], shape (n,); NaN for held joints.
        rms_by_joint: residual [N m], shape (n,); NaN for held joints.
    """

    name: str
    relative_error_percent: float
    sd_percent: float
    relative_error_percent_by_joint: Array
    rms_by_joint: Array


@overload
def score(model: Model, recording: Recording) -> Score: ...


@overload
def score(model: "ServoModel", recording: Recording) -> list[float]: ...


def score(model: "Model | ServoModel", recording: Recording) -> Score | list[float]:
    """The error of a model on a recording that it need not have been fitted on.

    Args:
        model: of torques, or of servos, which predicts positions.
        recording: of the same arm.

    Returns:
        For a model of torques its `Score`; for one of servos the rms of measured less simulated
        position, by joint [rad].

    Raises:
        DataError: the recording moves joints that the model knows nothing about, or is none.
    """
    if not isinstance(model, Model):
        from ident.api.servos import replay_error  # only now: half a second

        return replay_error(model, recording)
    arm = arm_of(model)
    recording = recorded(recording, arm.robot.joint_names)
    data = dataset_for(arm, summarise_log(recording.log, recording.name))
    if model.gains_nm_per_a:
        data = data.with_torque_times(np.array(model.gains_nm_per_a))
    found = predict(model, arm, data)
    errors = found.filtered[model.estimator]
    return Score(
        recording.name,
        errors.relative_percent,
        found.sd_percent[model.estimator],
        errors.relative_percent_by_joint,
        errors.rms_by_joint,
    )
