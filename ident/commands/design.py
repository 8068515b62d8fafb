"""`ident design`: an arm's file in, the excitation trajectory out."""

import json
import webbrowser
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.commands.options import Force, Json, assigned, effect_names, listing
from ident.excitation.optimisation.workers import workers
from ident.excitation.settings import (
    TRYING_S,
    DesignSettings,
    design_settings,
    settled,
)
from wamctl.arm.command_line import grouped, next_step, shipped_names


class Objective(StrEnum):
    """What to minimise."""

    CONDITION = "condition"
    DETERMINANT = "determinant"
    ERRORS = "errors"
    BALANCED = "balanced"


Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        callback=listing(DesignSettings),
        is_eager=True,
        metavar="NAME=VALUE",
        help="A design setting, such as terms, weights or patience; `--set help` lists them.",
    ),
]


@dataclass(frozen=True)
class Search:
    """How the motion is searched for."""

    seconds: Annotated[
        float | None, typer.Option("--time", help="Search time [s]; default 15, with --model 240.")
    ] = None
    seed: Annotated[int | None, typer.Option(help="Random seed; default 0.")] = None
    objective: Annotated[
        Objective | None,
        typer.Option(
            help="What to minimise. Default: parameter errors, at a condition number of at most 36."
        ),
    ] = None
    settings: Settings = None

    def given(self) -> dict[str, Any]:
        """The design settings that the command line changes."""
        wanted = {
            "time_s": self.seconds,
            "seed": self.seed,
            "objective": self.objective and self.objective.value,
        }
        named = {name: value for name, value in wanted.items() if value is not None}
        return assigned(self.settings, DesignSettings) | named


@dataclass(frozen=True)
class Shown:
    """What is shown and printed, and what becomes of earlier files."""

    view: Annotated[bool, typer.Option("--view", help="Show the motion in the browser.")] = False
    as_json: Json = False
    force: Force = False


@grouped
def design(
    config: Annotated[
        Path,
        typer.Option(
            help="Arm's file, or the bare name of a shipped one.", autocompletion=shipped_names
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="Trajectory file to write; its report goes beside it, as .html.")
    ] = Path("trajectory.yaml"),
    *,
    search: Search,
    start: Annotated[Path | None, typer.Option(help="Trajectory file to improve.")] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="A model.yaml from `ident run`: design for this particular arm."),
    ] = None,
    purpose: Annotated[
        str | None,
        typer.Option(
            "--for",
            help="EFFECT[:JOINT] or a gap.json: write the motion that makes the effect visible.",
            autocompletion=effect_names,
        ),
    ] = None,
    shown: Shown,
) -> None:
    """Design an excitation trajectory that keeps the arm's limits.

    Example: ident design --config wam7.yaml --out trajectory.yaml
    """
    if purpose is None:
        workers()  # they import while this process does
    from ident.commands.design_progress import Progress
    from ident.commands.outputs import file_written
    from ident.workflows.design import design_file, design_for, report_beside, view_beside
    from wamctl.arm.errors import ConfigurationError

    tried_out = {} if model is None else {"time_s": TRYING_S}
    chosen = settled(design_settings(tried_out | search.given()))
    if purpose is not None and model is not None:
        raise ConfigurationError("--model", ["has no say in the fixed motions of --for"])
    if purpose is None:
        with file_written(out, shown.force), Progress(chosen) as progress:
            found = design_file(config, out, chosen, start, progress.report, model)
        wishes = chosen.model_dump(mode="json", exclude_none=True)
        wishes |= {} if model is None else {"model": str(model)}
    else:
        with file_written(out, shown.force):
            found, wishes = design_for(config, out, purpose), {"for": purpose}
    written = [out, report_beside(found, config, out, wishes)]
    if shown.view:
        written.append(view_beside(found, config, out))
        webbrowser.open(written[-1].resolve().as_uri())
    for sentence in found.passed:
        typer.echo(f"This motion may not run: {sentence}.", err=True)
    promise = found.trajectory.promise
    if not found.passed:
        next_step("wamctl check --config", config, "--trajectory", out)
    typer.echo(json.dumps(promise, indent=2) if shown.as_json else "\n".join(map(str, written)))
