"""The search for the effect that a model lacks, on recordings in memory."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from ident.api.arm import Arm
from ident.api.inputs import Progress, by_simulation, checked, told
from ident.api.named import NamedEffects
from ident.api.recording import Recording
from ident.api.score import Score, score
from ident.gap.data.experiment import of_arm, with_reference_model
from ident.gap.options import Options
from ident.model.identified_model import Model
from ident.workflows.gap import Gap as GapRun
from ident.workflows.gap import gap_of
from wamctl.arm.errors import ConfigurationError

if TYPE_CHECKING:
    from ident.api.servos import DrivenEffects, ServoGap


class Gap(NamedEffects[GapRun]):
    """Where simulation and measurement disagree, and why.

    Attributes:
        run: the search with all its figures.
    """

    @property
    def model(self) -> Model:
        """The model with the effects added."""
        return self.run.model

    def score(self, recording: Recording) -> Score:
        """The error of the model with its effects on another recording.

        Raises:
            DataError: the recording moves joints that the model knows nothing about.
        """
        return score(self.model, recording)


@overload
def find_gap(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    method: Literal["simulation"],
    null_runs: int = 4,
    progress: Progress | None = None,
    **settings: Any,
) -> "ServoGap | DrivenEffects": ...


@overload
def find_gap(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    method: Literal["regression"] = "regression",
    model: Model | None = None,
    null_runs: int = 4,
    progress: Progress | None = None,
    **settings: Any,
) -> Gap: ...


def find_gap(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    method: Literal["regression", "simulation"] = "regression",
    model: Model | None = None,
    null_runs: int = 4,
    progress: Progress | None = None,
    **settings: Any,
) -> "Gap | ServoGap | DrivenEffects":
    """Find what a model of the arm misses, by name, as `ident gap` does.

    Args:
        arm: the arm.
        recordings: one recording, or several of the same arm.
        method: regression of torque on motion; or simulation, of commanded positions, or of torque
            where there are no such commands.
        model: a model that was trusted before: what has changed since? Default: the links are
            fitted to the recordings.
        null_runs: effect-free simulations behind the thresholds.
        progress: called with the step, and the share of it that is done where that is known.
        settings: identification settings that differ from the arm's.

    Raises:
        DataError: recordings from which nothing can be learned.
        ConfigurationError: an unknown setting, or a value out of its bounds.
    """
    chosen = checked(arm, recordings)
    if null_runs < 0:
        raise ConfigurationError("null_runs", [f"{null_runs} is less than none"])
    if by_simulation(method):
        from ident.api.servos import driven_gap_of, servo_gap  # only now: half a second
        from ident.workflows.output_error.driven import is_driven

        if all(is_driven(r.log) for r in chosen):
            return driven_gap_of(arm, chosen, told(progress), **settings)
        return servo_gap(arm, chosen, null_runs, told(progress))
    described = arm.of_recording(chosen[0].joints, **settings)
    source = of_arm(described, arm.file, [r.log for r in chosen], [r.name for r in chosen])
    if model is not None:
        source = with_reference_model(source, model)
    return Gap(gap_of(source, Options(null_runs=null_runs), told(progress)))
