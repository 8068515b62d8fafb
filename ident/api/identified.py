"""Identification of an arm from recordings in memory."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from ident.api.arm import Arm
from ident.api.inputs import Progress, by_simulation, checked, recorded, told
from ident.api.recording import Recording
from ident.api.result import Result, html_table, table
from ident.api.score import Score, score
from ident.checks.known_load import KnownLoad
from ident.model.arm import Arm as ArmModel
from ident.model.identified_model import Model
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.workflows.run import Run, run_data
from wamctl.arm.configuration.known_change import known_change
from wamctl.arm.errors import ConfigurationError, DataError

if TYPE_CHECKING:
    from ident.api.servos import IdentifiedServos


class Identified(Result[Run]):
    """An identified arm; `save` writes `run.json`, `model.yaml` and `report.html`.

    The verdict is `trustworthy`, `doubtful` or `refused`; remarks give its reasons.

    Attributes:
        run: the identification with all its figures.
    """

    @property
    def model(self) -> Model:
        """The identified model."""
        return self.run.model

    @property
    def error_percent(self) -> float:
        """Relative error on stretches that were not fitted [%]."""
        chosen = self.content["estimators"][self.content["estimator"]]
        return chosen["held_out"]["relative_error_percent"]

    @property
    def summary(self) -> str:
        """Arm, verdict and held-out error."""
        return f"{self.model.arm}: {self.verdict}, held-out error {self.error_percent:.2f} %"

    def table(self) -> Any:
        """Base parameters with CAD and identified values, standard errors and units.

        Returns:
            A pandas DataFrame where pandas is installed, else a list of dicts.
        """
        return table(self.content["base_parameters"])

    def score(self, recording: Recording) -> Score:
        """The model's error on another recording.

        Raises:
            DataError: the recording moves joints that the model knows nothing about.
        """
        return score(self.model, recording)

    def verify(self, max_error: float) -> "Identified":
        """Go on only with a model that may be trusted; gives itself.

        Args:
            max_error: largest held-out relative error [%].

        Raises:
            DataError: the verdict is `refused`, or the error is larger.
        """
        if self.verdict == "refused":
            reasons = " ".join(r["sentence"] for r in self.remarks)
            raise DataError(f"The identification was refused. {reasons}")
        if self.error_percent > max_error:
            raise DataError(
                f"The held-out error is {self.error_percent:.2f} %, more than the"
                f" {max_error:g} % that were allowed; see the report for the joints behind it."
            )
        return self

    def _repr_html_(self) -> str:
        return html_table(self.summary, self.content["base_parameters"])


@overload
def identify(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    method: Literal["simulation"],
    progress: Progress | None = None,
    **settings: Any,
) -> "IdentifiedServos | Identified": ...


@overload
def identify(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    method: Literal["regression"] = "regression",
    effects: Model | None = None,
    load: tuple[Recording, Sequence[float]] | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Identified: ...


def identify(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    method: Literal["regression", "simulation"] = "regression",
    effects: Model | None = None,
    load: tuple[Recording, Sequence[float]] | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> "Identified | IdentifiedServos":
    """Identify a physically feasible model of an arm, as `ident run` does.

    Args:
        arm: the arm.
        recordings: one recording, or several of the same arm.
        method: regression of torque on motion; or simulation, of commanded positions, or of torque
            where there are no such commands.
        effects: a model of `find_gap`, whose effects are taken off first and kept.
        load: a recording with a known load, and its mass [kg] and centre in the last link's
            parameter frame [m] (KG, X, Y, Z), which tell the gains of `torque_unit="A"`.
        progress: called with the step, and the share of it that is done where that is known.
        settings: identification settings, such as `cutoff_hz=10`.

    Raises:
        DataError: recordings from which nothing can be learned.
        ConfigurationError: an unknown setting, or a value out of its bounds.
    """
    given = checked(arm, recordings)
    if by_simulation(method):
        if unfit := [name for name, x in (("effects", effects), ("load", load)) if x is not None]:
            raise ConfigurationError(
                "method", [f"{' and '.join(unfit)}: of the regression; leave it out"]
            )
        from ident.api.servos import by_simulation_of  # only now: half a second

        return by_simulation_of(arm, given, told(progress), **settings)
    logs = [summarise_log(r.log, r.name) for r in given]
    model = arm.of_recording(logs[0].joint_names, **settings)
    data = [dataset_for(model, found) for found in logs]
    known = None if load is None else _known_load(model, *load)
    return Identified(run_data(model, data, told(progress), effects, load=known))


def _known_load(arm: ArmModel, recording: Recording, load: Sequence[float]) -> KnownLoad:
    change = known_change(f"load={','.join(map(str, load))}")
    one = recorded(recording, arm.robot.joint_names)
    return KnownLoad(dataset_for(arm, summarise_log(one.log, one.name)), change.load)
