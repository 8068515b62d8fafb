"""`ident simulate`: an identified model in closed loop, written as a log."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import Force
from wamctl.arm.command_line import next_step


def simulate(
    model: Annotated[Path, typer.Option(help="A model.yaml from `ident run` or `ident gap`.")],
    out: Annotated[Path, typer.Option(help="The log to write (.mcap).")],
    trajectory: Annotated[
        Path | None,
        typer.Option(
            help="Trajectory file; default: the one in the recording or the configuration."
        ),
    ] = None,
    config: Annotated[
        str | None,
        typer.Option(help="The arm's file with controller and drives; default: the recording's."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    force: Force = False,
) -> None:
    """Simulate an identified arm with its controller, and write a log.

    Example: ident simulate --model gap/model.yaml --out simulated.mcap
    """
    from ident.commands.outputs import log_written
    from ident.workflows.simulate import simulate_model
    from wamctl.arm.compilation import compilation_announced

    with log_written(out, force), compilation_announced("the simulation"):
        recording = simulate_model(model, trajectory, config, out)
    next_step("ident run", out)
    seconds = float(recording.stamp_ns[-1] - recording.stamp_ns[0]) * 1e-9
    if as_json:
        summary = {"log": str(out), "samples": len(recording.stamp_ns), "seconds": seconds}
        typer.echo(json.dumps(summary, indent=2))
        return
    typer.echo(f"{out}: {len(recording.stamp_ns)} samples, {seconds:.1f} s")
