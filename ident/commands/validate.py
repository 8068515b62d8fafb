"""`ident validate`: a model against recordings that it was not fitted on."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import (
    Cutoff,
    Input,
    Logs,
    Output,
    Settings,
    hold,
    next_after,
    settings_of,
    verdict_printed,
    with_input,
)
from wamctl.arm.command_line import grouped


@grouped
def validate(
    logs: Logs,
    model: Annotated[Path, typer.Option(help="A model.yaml from `ident run` or `ident gap`.")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("validated"),
    cutoff: Cutoff = None,
    settings: Settings = None,
    *,
    given: Input,
    output: Output,
) -> None:
    """Test a model on recordings that it was not fitted on.

    Example: ident validate other.mcap --model identified/model.yaml
    """
    changes = settings_of(cutoff, settings)
    from ident.commands.outputs import folder_written
    from ident.output_error.servo_model import is_servo_model
    from ident.regression.progress import shown
    from ident.report.validate_page import seen_before
    from ident.workflows.validate import validate_logs

    reading = given.reading()
    with folder_written(out, ("validate.json", "report.html"), output.force), shown() as tell:
        if is_servo_model(model):
            from ident.workflows.output_error.validate import validate_simulation

            text = validate_simulation(logs, model, out, reading, tell)
        else:
            text = validate_logs(logs, model, out, reading, tell, **changes)
    content = json.loads(text)
    if output.as_json:
        typer.echo(text.rstrip())
    else:
        verdict_printed(content)
        for log in content["logs"]:
            if "rms_q_by_joint" in log:
                errors = ", ".join(f"{1e3 * x:.2f}" for x in log["rms_q_by_joint"])
                typer.echo(f"{log['name']}: rms position error by joint {errors} mrad")
                continue
            raw = log["raw_torque"]["relative_error_percent"]
            typer.echo(
                f"{log['name']}: relative torque error {log['relative_error_percent']:.2f} % below"
                f" {log['cutoff_hz']:.3g} Hz (raw torque {raw:.2f} %)"
            )
        if "fitted_on" in content and (seen := seen_before(content)):
            typer.echo(seen)
        typer.echo(f"{out / 'report.html'}")
    recordings = with_input(logs, None, reading)
    if content.get("method") == "simulation" or content["effects"]:
        usual = ["ident export", model, "--to mjcf --out arm.xml"]
    else:
        usual = ["ident gap", *recordings, "--model", model]
    next_after(content["verdict"], content["remarks"], usual, recordings)
    hold(content["verdict"], output.strict)
