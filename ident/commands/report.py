"""`ident report compare`: two runs beside each other."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import Force, Json
from wamctl.arm.command_line import next_step


class Kind(StrEnum):
    """What to make of the results."""

    COMPARE = "compare"


def report(
    kind: Annotated[Kind, typer.Argument(help="compare: two runs side by side.")],
    first: Annotated[Path, typer.Argument(help="Result folder of `ident run`.")],
    second: Annotated[Path, typer.Argument(help="Another one, with the same joints.")],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("compare.html"),
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Compare two runs side by side: parameters with confidence intervals, errors, verdicts.

    Example: ident report compare monday friday --out compare.html
    """
    from ident.commands.outputs import file_written
    from ident.workflows.compare import compare_folders

    with file_written(out, force):
        sentence, text = compare_folders((first, second), out)
    typer.echo(text.rstrip() if as_json else f"{sentence}\n{out}")
    next_step("ident gap NEWER.mcap --model", first / "model.yaml")
