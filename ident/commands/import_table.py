"""`ident import`: a foreign table as a log."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ident.importers.recording import import_recording


def import_table(
    file: Annotated[Path, typer.Argument(help="Table to import: .csv or other text, .npz, .mat.")],
    mapping: Annotated[
        str, typer.Option("--map", help="Mapping file, or the bare name of a shipped one.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Log to write (.mcap).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Write a foreign recording as a log that `ident run` reads.

    Example: ident import traj1.csv --map xmate7p-map.yaml --out traj1.mcap
    """
    with Console(stderr=True).status(f"Importing {file.name}"):
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
    typer.echo(f"{out}: {len(recording.q)} samples of {len(recording.joint_names)} joints")
    typer.echo(f"over {seconds:.3f} s. Next: ident run {out}")
