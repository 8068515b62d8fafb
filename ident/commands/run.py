"""`ident run`: recordings in; model, numbers, and report out."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import (
    Cutoff,
    JointStates,
    Json,
    Logs,
    Rename,
    Settings,
    Strict,
    TorqueChoice,
    hold,
    rules_of,
    settings_of,
    verdict_printed,
)


def run(
    logs: Logs,
    robot: Annotated[
        Path | None, typer.Option(help="Arm's .yaml or .urdf; default: what the log carries.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("identified"),
    effects: Annotated[
        Path | None,
        typer.Option(
            help="A model.yaml of `ident gap`: its effects are taken off first, and kept."
        ),
    ] = None,
    solver: Annotated[
        str | None,
        typer.Option(help="Of the feasible fit: direct, or one of cvxpy's, such as SCS."),
    ] = None,
    cutoff: Cutoff = None,
    settings: Settings = None,
    torque: TorqueChoice = None,
    joint_states: JointStates = "/joint_states",
    as_json: Json = False,
    strict: Strict = False,
    rename: Rename = None,
) -> None:
    """Identify a physically feasible model from recordings.

    Example: ident run excitation.mcap --out identified
    """
    changes = settings_of(cutoff, settings) | ({"solver": solver} if solver else {})
    from ident.recordings.loading import Reading
    from ident.regression.progress import shown
    from ident.workflows.run import run_logs

    reading = Reading(joint_states, torque=torque.value if torque else None, rules=rules_of(rename))
    with shown() as tell:
        text = run_logs(logs, robot, out, reading, tell, effects, **changes)
    content = json.loads(text)
    for log in content["logs"]:
        for remark in log["remarks"]:
            typer.echo(f"{log['name']}: {remark}.", err=True)
    if as_json:
        typer.echo(text.rstrip())
    else:
        verdict_printed(content)
        typer.echo(f"{out / 'report.html'}")
    hold(content["verdict"], strict)
