"""Identification of servos by simulation, on recordings in memory."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ident.api.arm import Arm
from ident.api.commanded import commanded
from ident.api.inputs import recorded
from ident.api.recording import Recording
from ident.api.result import Result
from ident.api.tables import table
from ident.output_error.recordings import segments_of
from ident.output_error.servo_model import ServoModel
from ident.regression.progress import Tell
from ident.workflows.output_error.run import ServoRun, simulated_run


class IdentifiedServos(Result[ServoRun]):
    """An arm with position servos, identified by simulation; its files are those of `Identified`.

    The verdict is `trustworthy` or `doubtful`; remarks give its reasons.

    Attributes:
        run: the identification with all its figures.
    """

    @property
    def model(self) -> ServoModel:
        """The identified arm."""
        return self.run.model

    def table(self) -> Any:
        """Settings with standard errors: a pandas DataFrame, or a list of dicts without pandas."""
        return table(self.content["parameters"])

    def score(self, recording: Recording) -> list[float]:
        """Rms of measured less simulated position along a recording, by joint [rad]."""
        recording = recorded(recording)
        parts = segments_of(recording.log, self.model.robot.joint_names, recording.name)
        left = np.concatenate([s.q - self.model.replay(s) for s in parts])
        return np.sqrt(np.mean(left**2, axis=0)).tolist()


def identified_servos(arm: Arm, recordings: Sequence[Recording], tell: Tell) -> IdentifiedServos:
    """Servos, gears and friction by simulation of the commanded positions.

    Raises:
        DataError: a recording without commanded positions.
    """
    known, found = commanded(arm, recordings)
    return IdentifiedServos(simulated_run(known, found, tell))
