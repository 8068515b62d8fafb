"""The search for the effect that a model lacks, on recordings in memory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ident.api.arm import Arm
from ident.api.recording import Recording
from ident.api.score import Score, score, several
from ident.api.tables import html_table
from ident.gap.data.experiment import of_arm, with_reference_model
from ident.gap.settings import Options
from ident.model.identified_model import Model
from ident.workflows.gap import Gap as Outcome
from ident.workflows.gap import gap_of
from wamctl.arm.errors import DataError


@dataclass(frozen=True)
class Effect:
    """An effect that was named.

    Attributes:
        name: its id, such as `stribeck`.
        joints: names of its joints.
        parameters: value, standard error and unit of each, by name.
        equation: the torque that it adds.
        rivals: effects that cannot be told from it, with their joints from 1.
    """

    name: str
    joints: tuple[str, ...]
    parameters: dict[str, dict[str, Any]]
    equation: str
    rivals: tuple[dict[str, Any], ...]


@dataclass(frozen=True)
class Gap:
    """Where simulation and measurement disagree, and why.

    Attributes:
        outcome: the search with all its figures.
    """

    outcome: Outcome = field(repr=False)

    @property
    def content(self) -> dict[str, Any]:
        """The content of `gap.json`."""
        return self.outcome.content

    @property
    def verdict(self) -> str:
        """`no_gap`, `named`, `ambiguous`, `unknown` or `data_fault`."""
        return self.content["verdict"]

    @property
    def remarks(self) -> list[dict[str, Any]]:
        """Remarks about the data: code, joints, sentence."""
        return self.content.get("remarks", [])

    @property
    def sentences(self) -> list[str]:
        """The verdict in sentences."""
        return self.outcome.sentences

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that were named, in the order in which they were found."""
        names = self.content["joints"]
        return tuple(
            Effect(
                e["name"],
                tuple(names[j - 1] for j in e["joints"]),
                e["parameters"],
                e["equation"],
                tuple(e["rivals"]),
            )
            for e in self.content["effects"]
        )

    @property
    def model(self) -> Model:
        """The model with the effects added."""
        return self.outcome.model

    def score(self, recording: Recording) -> Score:
        """The error of the model with its effects on another recording.

        Raises:
            DataError: the recording moves joints that the model knows nothing about.
        """
        return score(self.model, recording)

    def report(self, path: str | Path) -> Path:
        """Write the report, one HTML page, and give its path."""
        Path(path).write_text(self.outcome.page(), encoding="utf-8")
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write `gap.json`, `model.yaml` and `report.html`, as `ident gap` does.

        Raises:
            DataError: the folder cannot be written.
        """
        self.outcome.write(Path(folder))
        return Path(folder)

    def _repr_html_(self) -> str:
        rows = [
            {
                "effect": e.name,
                "joints": ", ".join(e.joints),
                "parameter": name,
                "value": p["value"],
                "sd": p["sd"],
                "unit": p["unit"],
            }
            for e in self.effects
            for name, p in e.parameters.items()
        ]
        return html_table(" ".join(self.sentences), rows)


def find_gap(
    arm: Arm,
    recordings: Recording | Sequence[Recording],
    *,
    model: Model | None = None,
    null_runs: int = 4,
    progress: Callable[[str, float | None], None] | None = None,
    **settings: Any,
) -> Gap:
    """Find what a model of the arm misses, by name, as `ident gap` does.

    Args:
        arm: the arm.
        recordings: one recording, or several of the same arm.
        model: a model that was trusted before: what has changed since? Default: the links are
            fitted to the recordings.
        null_runs: effect-free simulations behind the thresholds.
        progress: called with the step, and the share of it that is done where that is known.
        settings: identification settings that differ from the arm's.

    Raises:
        DataError: recordings from which nothing can be learned.
        ConfigurationError: an unknown setting, or a value out of its bounds.
    """
    chosen = several(recordings)
    if not chosen:
        raise DataError("No recording was given; the search needs at least one.")
    described = arm.of_recording(chosen[0].joints, **settings)
    source = of_arm(described, arm.file, [r.log for r in chosen], [r.name for r in chosen])
    if model is not None:
        source = with_reference_model(source, model)

    def tell(what: str, share: float | None = None) -> None:
        if progress is not None:
            progress(what, share)

    return Gap(gap_of(source, Options(null_runs=null_runs), tell))
