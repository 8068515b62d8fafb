"""Work by simulation: servos identified, and what the models of driven arms miss."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ident.api.arm import Arm
from ident.api.identified import Identified
from ident.api.inputs import recorded
from ident.api.named import NamedEffects
from ident.api.recording import Recording
from ident.api.result import Result, table
from ident.model.arm import Arm as ArmModel
from ident.model.identified_model import Model
from ident.output_error.recordings import segments_of
from ident.output_error.search.settings import SearchSettings
from ident.output_error.servo_model import ServoModel
from ident.output_error.setup import MotionSegment
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.regression.progress import Tell
from ident.workflows.output_error.driven import driven_run, is_driven
from ident.workflows.output_error.driven_gap import DrivenGap, driven_gap
from ident.workflows.output_error.gap import GapOfServos, gap_of_servos
from ident.workflows.output_error.run import ServoRun, simulated_run
from ident.workflows.run import Run, run_data
from wamctl.arm.errors import ConfigurationError


def commanded(arm: Arm, recordings: Sequence[Recording]) -> tuple[ArmModel, list[MotionSegment]]:
    """The arm in the order of the recordings' joints, and their segments with commands.

    Raises:
        DataError: a recording without commanded positions.
    """
    known = arm.of_recording(recordings[0].log.joint_names)
    names = known.robot.joint_names
    return known, [s for r in recordings for s in segments_of(r.log, names, r.name)]


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
        return replay_error(self.model, recording)


def replay_error(model: ServoModel, recording: Recording) -> list[float]:
    """Rms of measured less simulated position along a recording, by joint [rad].

    Raises:
        DataError: a recording without commanded positions, or of other joints.
    """
    recording = recorded(recording, model.robot.joint_names)
    parts = segments_of(recording.log, model.robot.joint_names, recording.name)
    left = np.concatenate([s.q - model.replay(s) for s in parts])
    return np.sqrt(np.mean(left**2, axis=0)).tolist()


def identified_servos(arm: Arm, recordings: Sequence[Recording], tell: Tell) -> IdentifiedServos:
    """Servos, gears and friction by simulation of the commanded positions.

    Raises:
        DataError: a recording without commanded positions.
    """
    known, found = commanded(arm, recordings)
    return IdentifiedServos(simulated_run(known, found, tell))


def by_simulation_of(
    arm: Arm, recordings: Sequence[Recording], tell: Tell, **settings: Any
) -> IdentifiedServos | Identified:
    """Servos by simulation of commanded positions, or the arm by that of recorded torque.

    Raises:
        DataError: recordings from which nothing can be learned.
        ConfigurationError: an unknown setting, or one of the regression for servos.
    """
    if all(is_driven(r.log) for r in recordings):
        return Identified(driven_run(_by_regression(arm, recordings, tell, **settings), tell))
    if settings:
        raise ConfigurationError(
            "method", [f"{', '.join(settings)} belongs to the regression; leave it out"]
        )
    return identified_servos(arm, recordings, tell)


def _by_regression(arm: Arm, recordings: Sequence[Recording], tell: Tell, **settings: Any) -> Run:
    logs = [summarise_log(r.log, r.name) for r in recordings]
    known = arm.of_recording(logs[0].joint_names, **settings)
    return run_data(known, [dataset_for(known, found) for found in logs], tell)


class ServoGap(NamedEffects[GapOfServos]):
    """Where the simulated positions of an arm with servos differ from the measured ones, and why.

    Attributes:
        run: the search with all its figures.
    """

    @property
    def model(self) -> ServoModel:
        """The arm with the effects added."""
        return self.run.model


def servo_gap(arm: Arm, recordings: Sequence[Recording], null_runs: int, tell: Tell) -> ServoGap:
    """What a model of the arm with its servos misses, by name.

    Args:
        arm: the arm.
        recordings: of commands and positions.
        null_runs: effect-free simulations behind the thresholds.
        tell: hears what is being done.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    known, segments = commanded(arm, recordings)
    options = SearchSettings(null_runs=null_runs)
    return ServoGap(gap_of_servos(known, segments, options, tell))


class DrivenEffects(NamedEffects[DrivenGap]):
    """Where an arm that recorded torque drives is not where it was measured, and why.

    Attributes:
        run: the search with all its figures.
    """

    @property
    def model(self) -> Model:
        """Links and friction by simulation, without the effects."""
        return self.run.model


def driven_gap_of(
    arm: Arm, recordings: Sequence[Recording], tell: Tell, **settings: Any
) -> DrivenEffects:
    """What a model of the arm misses, by name, from the positions that recorded torque gives it.

    Args:
        arm: the arm.
        recordings: of positions and torque.
        tell: hears what is being done.
        settings: identification settings that differ from the arm's.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    run = _by_regression(arm, recordings, tell, **settings)
    return DrivenEffects(driven_gap(run, SearchSettings(), tell))
