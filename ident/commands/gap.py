"""`ident gap`: where simulation and measurement disagree, and which effect is missing."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.checks.remark import speaks_against_input
from ident.commands.options import (
    CORRECTED,
    Input,
    Logs,
    Method,
    MethodChoice,
    Output,
    Robot,
    Settings,
    hold,
    recordings_told,
    refuse_with_simulation,
    settings_of,
    verdict_printed,
    with_input,
)
from wamctl.arm.command_line import grouped, next_step


@dataclass(frozen=True)
class Search:
    """What the search begins with, and what it keeps."""

    model: Annotated[
        Path | None,
        typer.Option(
            help="A model.yaml trusted so far: find what has changed since. Friction is fitted"
            " anew, and its change told."
        ),
    ] = None
    null_runs: Annotated[
        int,
        typer.Option(
            min=0, metavar="N", help="Number of effect-free simulations that set the thresholds."
        ),
    ] = 4
    with_suspected: Annotated[
        bool, typer.Option("--with-suspected", help="Keep suspected effects in the model.")
    ] = False
    settings: Settings = None


@grouped
def gap(
    logs: Logs,
    wanted: Search,
    robot: Robot = None,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("gap"),
    *,
    given: Input,
    output: Output,
    method: MethodChoice = Method.AUTO,
) -> None:
    """Find what the model misses, by name, and add it.

    Example: ident gap excitation.mcap --out gap
    """
    changes = settings_of(None, wanted.settings)
    from ident.commands.outputs import folder_written
    from ident.gap.options import Options
    from ident.output_error.search.settings import SearchSettings
    from ident.regression.progress import Lines
    from ident.workflows.gap import gap_logs
    from ident.workflows.method import method_for
    from wamctl.arm.compilation import compilation_announced

    reading = given.reading()
    names, tell = ("gap.json", "model.yaml", "report.html"), Lines().tell
    with folder_written(out, names, output.force), compilation_announced("the search"):
        chosen, remarks = method, []
        if method is Method.AUTO:
            chosen, remarks = method_for(logs, robot, reading)
        if chosen == Method.SIMULATION:
            from ident.workflows.output_error.driven import are_driven
            from ident.workflows.output_error.driven_gap import gap_driven
            from ident.workflows.output_error.gap import gap_simulation

            for_torque = ("--model", wanted.model), ("--with-suspected", wanted.with_suspected)
            unfit = [name for name, value in for_torque if value]
            limits = SearchSettings(null_runs=wanted.null_runs)
            if method is Method.SIMULATION and are_driven(logs, robot, reading):
                refuse_with_simulation(unfit)
                text, sentences = gap_driven(logs, robot, out, reading, limits, tell, **changes)
            else:
                refuse_with_simulation([*unfit, *(f"--set {name}" for name in changes)], remarks)
                args = logs, robot, out, reading, limits, tell, remarks
                text, sentences = gap_simulation(*args)
        else:
            options = Options(null_runs=wanted.null_runs, with_suspected=wanted.with_suspected)
            arm = (robot, wanted.model)
            text, sentences = gap_logs(logs, arm, out, reading, options, tell, **changes)
    content = json.loads(text)
    recordings_told(content)
    if output.as_json:
        typer.echo(text.rstrip())
    else:
        verdict_printed(content)
        for sentence in sentences:
            typer.echo(sentence)
        typer.echo(f"{out / 'report.html'}")
    next_step(*_next(content, with_input(logs, robot, reading, changes), out))
    hold(content["trust"], output.strict)


def _next(content: Mapping[str, Any], recordings: Sequence[object], out: Path) -> list[object]:
    """The command that the verdict suggests."""
    if content["verdict"] == "data_fault":
        return ["record again, then: ident gap", *recordings]
    if speaks_against_input(content["remarks"]):
        return [CORRECTED]
    if content.get("method") == "simulation":
        return ["ident validate OTHER.mcap --model", out / "model.yaml"]
    if any(effect["separating_experiment"] for effect in content["effects"]):
        return ["ident design --config ARM.yaml --for", out / "gap.json"]
    if content["effects"]:
        return ["ident run", *recordings, "--effects", out / "model.yaml"]
    if content["suspected"]:
        first = content["suspected"][0]
        place = ":".join([first["name"], *map(str, first["joints"][:1])])
        return ["ident design --config ARM.yaml --for", place]
    return ["ident validate OTHER.mcap --model", out / "model.yaml"]
