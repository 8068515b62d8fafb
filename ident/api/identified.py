"""Identification of an arm from recordings in memory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ident.api.arm import Arm
from ident.api.recording import Recording
from ident.api.score import Score, score, several
from ident.api.tables import html_table, table
from ident.model.identified_model import Model
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import survey
from ident.regression.progress import silent
from ident.workflows.run import Run, run_data
from wamctl.arm.errors import DataError

Progress = Callable[[str, float | None], None]


@dataclass(frozen=True)
class Identified:
    """An identified arm.

    Attributes:
        run: the identification with all its figures.
    """

    run: Run = field(repr=False)

    @property
    def model(self) -> Model:
        """The identified model."""
        return self.run.model

    @property
    def content(self) -> dict[str, Any]:
        """The content of `run.json`."""
        return self.run.content

    @property
    def verdict(self) -> str:
        """`trustworthy`, `doubtful` or `refused`."""
        return self.content.get("verdict", "not judged")

    @property
    def remarks(self) -> list[dict[str, Any]]:
        """The reasons of the verdict: code, joints, sentence."""
        return self.content.get("remarks", [])

    @property
    def error_percent(self) -> float:
        """Relative error on stretches that were not fitted [%]."""
        chosen = self.content["estimators"][self.content["estimator"]]
        return chosen["held_out"]["relative_error_percent"]

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

    def report(self, path: str | Path) -> Path:
        """Write the report, one HTML page, and give its path."""
        Path(path).write_text(self.run.page(), encoding="utf-8")
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write `run.json`, `model.yaml` and `report.html`, as `ident run` does.

        Raises:
            DataError: the folder cannot be written.
        """
        self.run.write(Path(folder))
        return Path(folder)

    def _repr_html_(self) -> str:
        return html_table(
            f"{self.model.arm}: {self.verdict}, held-out error {self.error_percent:.2f} %",
            self.content["base_parameters"],
        )


def identify(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    effects: Model | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Identified:
    """Identify a physically feasible model of an arm, as `ident run` does.

    Args:
        arm: the arm.
        recordings: one recording, or several of the same arm.
        effects: a model of `find_gap`, whose effects are taken off first and kept.
        progress: called with the step, and the share of it that is done where that is known.
        settings: identification settings, such as `cutoff_hz=10`.

    Raises:
        DataError: recordings from which nothing can be learned.
        ConfigurationError: an unknown setting, or a value out of its bounds.
    """
    logs = [survey(r.log, r.name) for r in several(recordings)]
    if not logs:
        raise DataError("No recording was given; identification needs at least one.")
    model = arm.of_recording(logs[0].joint_names, **settings)
    data = [dataset_for(model, found) for found in logs]
    return Identified(run_data(model, data, _told(progress), effects))


def _told(progress: Progress | None) -> Any:
    if progress is None:
        return silent
    return lambda what, share=None: progress(what, share)
