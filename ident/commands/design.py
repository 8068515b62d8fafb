"""`ident design`: an arm's file in, the excitation trajectory out."""

import json
import webbrowser
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import Json


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
        help="NAME=VALUE: terms, weights, constraints (all or joint_motion), most_condition,"
        " gain, patience, processes.",
    ),
]


def design(
    config: Annotated[Path, typer.Option(help="Arm's file, or the bare name of a shipped one.")],
    out: Annotated[
        Path, typer.Option(help="Trajectory file; its report stands beside it, as .html.")
    ] = Path("trajectory.yaml"),
    seconds: Annotated[
        float | None, typer.Option("--time", help="Time to search [s]; default 240.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of all random choices; default 0.")] = None,
    objective: Annotated[
        Objective | None,
        typer.Option(
            help="Default: errors, at a condition number of 36 or the least that is found."
        ),
    ] = None,
    start: Annotated[Path | None, typer.Option(help="Trajectory file to go on from.")] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="model.yaml of `ident run`: the motion that suits this very arm best."),
    ] = None,
    purpose: Annotated[
        str | None,
        typer.Option("--for", help="EFFECT[:JOINT] or a gap.json: the motion that shows it."),
    ] = None,
    settings: Settings = None,
    view: Annotated[bool, typer.Option("--view", help="Show the motion in the browser.")] = False,
    as_json: Json = False,
) -> None:
    """Design an excitation trajectory that keeps the arm's limits.

    Example: ident design --config wam7.yaml --out trajectory.yaml
    """
    from ident.commands.design_progress import Progress
    from ident.excitation.settings import design_settings, settings_from, settled
    from ident.workflows.design import design_file, design_for, report_beside, view_beside
    from wamctl.arm.errors import ConfigurationError

    wanted = {"time_s": seconds, "seed": seed, "objective": objective and objective.value}
    given = {name: value for name, value in wanted.items() if value is not None}
    chosen = settled(design_settings(settings_from(settings) | given))
    if purpose is not None and model is not None:
        raise ConfigurationError("--model", ["has no say in the fixed motions of --for"])
    if purpose is None:
        with Progress(chosen) as progress:
            found = design_file(config, out, chosen, start, progress.report, model)
        wishes = chosen.model_dump(mode="json", exclude_none=True)
        wishes |= {} if model is None else {"model": str(model)}
    else:
        found, wishes = design_for(config, out, purpose), {"for": purpose}
    written = [out, report_beside(found, config, out, wishes)]
    if view:
        written.append(view_beside(found, config, out))
        webbrowser.open(written[-1].resolve().as_uri())
    for sentence in found.passed:
        typer.echo(f"This motion may not run: {sentence}.", err=True)
    promise = found.trajectory.promise
    typer.echo(json.dumps(promise, indent=2) if as_json else "\n".join(map(str, written)))
