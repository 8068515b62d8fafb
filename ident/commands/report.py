"""`ident report compare`: two runs beside each other."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import Json


class Kind(StrEnum):
    """What to make of the results."""

    COMPARE = "compare"


def report(
    kind: Annotated[Kind, typer.Argument(help="compare: two runs beside each other.")],
    first: Annotated[Path, typer.Argument(help="Result folder of `ident run`.")],
    second: Annotated[Path, typer.Argument(help="Another one, of the same joints.")],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("compare.html"),
    as_json: Json = False,
) -> None:
    """Put two runs beside each other: parameters with intervals, errors, verdicts.

    Example: ident report compare monday friday --out compare.html
    """
    from ident.workflows.compare import compare_folders

    sentence, text = compare_folders((first, second), out)
    typer.echo(text.rstrip() if as_json else f"{sentence}\n{out}")
