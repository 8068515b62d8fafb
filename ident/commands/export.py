"""`ident export`: an identified model for other programs."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ident.effects.bound_effects import load_model
from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.programs import left_out_of_c, left_out_of_python, to_c, to_python
from ident.export.urdf import left_out_of_urdf, to_urdf
from wamctl.arm.errors import DataError


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


def export(
    model: Annotated[Path, typer.Argument(help="The model.yaml of ident run or ident gap.")],
    to: Annotated[Format, typer.Option(help="Format to write.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
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
    if as_json:
        summary = {"file": str(out), "format": to.value, "left_out": missing}
        typer.echo(json.dumps(summary, indent=2))
        return
    for sentence in missing:
        typer.echo(f"{out}: {sentence}.", err=True)
    typer.echo(out)
