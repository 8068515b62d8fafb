"""`ident import`: a foreign table as a log."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from ident.commands.options import Force
from ident.commands.outputs import log_written
from ident.importers.recording import LEFT_OUT, import_recording
from wamctl.arm.command_line import is_quiet, next_step, shipped_names


def import_table(
    file: Annotated[
        Path, typer.Argument(help="Table to import: .csv or other text, .parquet, .npz, .mat.")
    ],
    mapping: Annotated[
        str,
        typer.Option(
            "--map",
            help="Mapping file, or the bare name of a shipped one.",
            autocompletion=shipped_names,
        ),
    ],
    out: Annotated[Path, typer.Option("--out", help="Log to write (.mcap).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    force: Force = False,
) -> None:
    """Convert a table of measurements to a log that `ident run` reads.

    Example: ident import traj1.csv --map xmate7p-map.yaml --out traj1.mcap
    """
    console = Console(stderr=True, quiet=is_quiet())
    with log_written(out, force), console.status(escape(f"Importing {file.name}")):
        recording = import_recording(file, mapping, out)
    seconds = float(recording.stamp_ns[-1] - recording.stamp_ns[0]) * 1e-9
    if as_json:
        summary = {
            "log": str(out),
            "samples": len(recording.q),
            "seconds": seconds,
            "joints": list(recording.joint_names),
        }
        typer.echo(json.dumps(summary, indent=2))
        return
    size = f"{len(recording.q)} samples of {len(recording.joint_names)} joints"
    typer.echo(f"{out}: {size} over {seconds:.3f} s")
    if LEFT_OUT in recording.metadata:
        typer.echo(f"Left out: {recording.metadata[LEFT_OUT]}.")
    knows_arm = "robot.urdf" in recording.attachments
    next_step("ident run", out, *([] if knows_arm else ["--robot ARM.urdf"]))
