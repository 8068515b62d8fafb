"""`ident gap`: where simulation and measurement disagree, and which effect is missing."""

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import (
    JointStates,
    Json,
    Logs,
    Rename,
    Strict,
    TorqueChoice,
    hold,
    rules_of,
    verdict_printed,
)


def gap(
    logs: Logs,
    model: Annotated[
        Path | None,
        typer.Option(help="A model.yaml that was trusted before: what has changed since?"),
    ] = None,
    robot: Annotated[
        Path | None, typer.Option(help="Arm's .yaml or .urdf; default: what the log carries.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("gap"),
    null_runs: Annotated[
        int, typer.Option(min=0, help="Effect-free runs behind the thresholds.")
    ] = 4,
    torque: TorqueChoice = None,
    joint_states: JointStates = "/joint_states",
    as_json: Json = False,
    strict: Strict = False,
    rename: Rename = None,
) -> None:
    """Find what the model misses, by name, and add it.

    Example: ident gap excitation.mcap --out gap
    """
    from ident.gap.settings import Options
    from ident.recordings.loading import Reading
    from ident.workflows.gap import gap_logs
    from wamctl.arm.compilation import compilation_announced

    reading = Reading(joint_states, torque=torque.value if torque else None, rules=rules_of(rename))
    options = Options(null_runs=null_runs)
    with compilation_announced("the search"):
        text, sentences = gap_logs(logs, (robot, model), out, reading, options, _Told().tell)
    content = json.loads(text)
    if as_json:
        typer.echo(text.rstrip())
    else:
        verdict_printed(content, "trust")
        for sentence in sentences:
            typer.echo(sentence)
        typer.echo(f"{out / 'report.html'}")
    hold(content["trust"], strict)


class _Told:
    """Progress on stderr, with the seconds since the start."""

    def __init__(self) -> None:
        self._began = time.monotonic()

    def tell(self, what: str) -> None:
        typer.echo(f"{time.monotonic() - self._began:5.1f} s  {what}", err=True)
