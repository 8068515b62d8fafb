"""`ident export`: an identified model for other programs."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.effects.bound_effects import load_model
from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.programs import left_out_of_c, left_out_of_python, to_c, to_python
from ident.export.replay import replay
from ident.export.urdf import left_out_of_urdf, to_urdf
from ident.model.identified_model import Model
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.recording import read_recording


class Format(StrEnum):
    """What an identified arm can be written as."""

    URDF = "urdf"
    MJCF = "mjcf"
    C = "c"
    PYTHON = "python"


_WRITERS = {
    Format.URDF: (to_urdf, left_out_of_urdf),
    Format.MJCF: (to_mjcf, left_out_of_mjcf),
    Format.C: (to_c, left_out_of_c),
    Format.PYTHON: (to_python, left_out_of_python),
}


_SIMULATORS = {"mujoco": "the exported arm in MuJoCo", "own": "ident simulate"}


def export(
    model: Annotated[Path, typer.Argument(help="The model.yaml of ident run or ident gap.")],
    to: Annotated[Format, typer.Option(help="Format to write.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
    log: Annotated[
        Path | None,
        typer.Option(
            "--replay", help="With mjcf: a log that MuJoCo follows in closed loop, for comparison."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Write an identified arm for other programs.

    URDF and MJCF hold the whole arm; the C header and the Python module compute its torque, with
    every named effect that one sample tells.

    Example: ident export identified/model.yaml --to mjcf --out arm.xml
    """
    identified = load_model(model)
    write, left_out = _WRITERS[to]
    text = write(identified)
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DataError(f"{out} cannot be written ({error.strerror}).") from error
    missing = left_out(identified)
    errors = None if log is None else _replayed(to, text, identified, log)
    if as_json:
        summary: dict[str, Any] = {"file": str(out), "format": to.value, "left_out": missing}
        if errors is not None:
            summary["replay_rms_rad"] = errors
        typer.echo(json.dumps(summary, indent=2))
        return
    for sentence in missing:
        typer.echo(f"{out}: {sentence}.", err=True)
    for name, values in (errors or {}).items():
        words = ", ".join(f"{x:.2g}" for x in values)
        typer.echo(f"{log}: rms joint error of {_SIMULATORS[name]} {words} rad", err=True)
    typer.echo(out)


def _replayed(to: Format, text: str, model: Model, log: Path) -> dict[str, list[float]]:
    """Rms joint errors of MuJoCo and of the own simulation along a log."""
    if to is not Format.MJCF:
        raise ConfigurationError("--replay", [f"goes with --to mjcf, not with --to {to.value}"])
    return replay(text, model, read_recording(log), str(log)).rms()
