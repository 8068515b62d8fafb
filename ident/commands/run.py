"""`ident run`: recordings in; model, numbers, and report out."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.commands.options import (
    Cutoff,
    Input,
    Logs,
    Method,
    MethodChoice,
    Output,
    Robot,
    Settings,
    hold,
    next_after,
    recordings_told,
    refuse_with_simulation,
    settings_of,
    verdict_printed,
    with_input,
)
from wamctl.arm.command_line import grouped


@dataclass(frozen=True)
class Fit:
    """How the model is fitted."""

    effects: Annotated[
        Path | None,
        typer.Option(
            help="A model.yaml from `ident gap`: its effects are subtracted first, and kept."
        ),
    ] = None
    load: Annotated[
        str | None,
        typer.Option(
            metavar="LOG=KG,X,Y,Z",
            help="A further recording with a known load, its centre in the last link's parameter"
            " frame [m]; it tells the drives' gains where efforts are currents (torque_unit: A).",
        ),
    ] = None
    solver: Annotated[
        str | None,
        typer.Option(help="Solver of the feasible fit: direct, or one of cvxpy's, such as SCS."),
    ] = None
    cutoff: Cutoff = None
    settings: Settings = None


@grouped
def run(
    logs: Logs,
    robot: Robot = None,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("identified"),
    *,
    fit: Fit,
    given: Input,
    output: Output,
    method: MethodChoice = Method.AUTO,
) -> None:
    """Identify a physically feasible model from recordings.

    Example: ident run excitation.mcap --out identified
    """
    changes = settings_of(fit.cutoff, fit.settings)
    changes |= {"solver": fit.solver} if fit.solver else {}
    from ident.commands.outputs import folder_written
    from ident.regression.progress import shown
    from ident.report.run_page import asks_for_gap
    from ident.workflows.method import method_for
    from ident.workflows.run import run_logs

    reading, names = given.reading(), ("run.json", "model.yaml", "report.html")
    with folder_written(out, names, output.force), shown() as tell:
        chosen, remarks = method, []
        if method is Method.AUTO:
            chosen, remarks = method_for(logs, robot, reading)
        if chosen == Method.SIMULATION:
            from ident.workflows.output_error.driven import are_driven, driven_run
            from ident.workflows.output_error.run import run_simulation

            unfit = [name for name, x in (("--effects", fit.effects), ("--load", fit.load)) if x]
            if method is Method.SIMULATION and are_driven(logs, robot, reading):
                refuse_with_simulation(unfit)
                text = run_logs(logs, robot, out, reading, tell, further=driven_run, **changes)
            else:
                refuse_with_simulation([*unfit, *(f"--set {name}" for name in changes)], remarks)
                text = run_simulation(logs, robot, out, reading, tell, remarks)
        else:
            text = run_logs(logs, robot, out, reading, tell, fit.effects, fit.load, **changes)
    content = json.loads(text)
    recordings_told(content)
    if output.as_json:
        typer.echo(text.rstrip())
    else:
        verdict_printed(content)
        for sentence in _errors_said(content):
            typer.echo(sentence)
        typer.echo(f"{out / 'report.html'}")
    usual = ["ident validate OTHER.mcap --model", out / "model.yaml"]
    recordings = with_input(logs, robot, reading, changes)
    if not fit.effects and asks_for_gap(content):
        usual = ["ident gap", *recordings]
    next_after(content["verdict"], content["remarks"], usual, recordings)
    hold(content["verdict"], output.strict)


def _errors_said(content: dict[str, Any]) -> list[str]:
    """How far the model is from the recordings."""
    from ident.report.run_page import error_sentences

    if content["method"] != Method.SIMULATION:
        return error_sentences(content)
    if "agreement" in content:
        from ident.report.servos.driven_section import driven_sentence

        return [*error_sentences(content), driven_sentence(content)]
    from ident.report.servos.run_page import error_sentence

    return [error_sentence(content)]
