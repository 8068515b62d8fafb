"""`ident validate`: a model against recordings that it was not fitted on."""

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


def validate(
    logs: Logs,
    model: Annotated[Path, typer.Option(help="The model.yaml of `ident run`.")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("validated"),
    cutoff: Cutoff = None,
    settings: Settings = None,
    torque: TorqueChoice = None,
    joint_states: JointStates = "/joint_states",
    as_json: Json = False,
    strict: Strict = False,
    rename: Rename = None,
) -> None:
    """Test a model on recordings that it was not fitted on.

    Example: ident validate other.mcap --model identified/model.yaml
    """
    changes = settings_of(cutoff, settings)
    from ident.recordings.loading import Reading
    from ident.regression.progress import shown
    from ident.workflows.validate import validate_logs

    reading = Reading(joint_states, torque=torque.value if torque else None, rules=rules_of(rename))
    with shown() as tell:
        text = validate_logs(logs, model, out, reading, tell, **changes)
    content = json.loads(text)
    if as_json:
        typer.echo(text.rstrip())
    else:
        verdict_printed(content)
        for log in content["logs"]:
            typer.echo(
                f"{log['name']}: relative torque error {log['relative_error_percent']:.2f} %"
                f" (raw torque {log['raw_torque']['relative_error_percent']:.2f} %)"
            )
        typer.echo(f"{out / 'report.html'}")
    hold(content["verdict"], strict)
