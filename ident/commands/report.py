"""`ident report compare`: two runs beside each other."""

import json
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.commands.options import Force, Json
from ident.report.compare_page import Comparison, compare_content, compare_page
from ident.report.page import render
from ident.workflows.run_json import as_json
from wamctl.arm.command_line import next_step
from wamctl.arm.errors import DataError, write_text


def compare_folders(folders: Sequence[Path], out: Path) -> tuple[str, str]:
    """Write a page on two runs; gives its verdict, and the comparison as JSON.

    Args:
        folders: two result folders of `ident run`.
        out: the page.

    Raises:
        DataError: no such results, other joints, or a file that cannot be written.
    """
    first, second = (_content(folder) for folder in folders)
    if first["joints"] != second["joints"]:
        raise DataError(
            f"{folders[0]} has the joints {', '.join(first['joints'])}, and {folders[1]}"
            f" {', '.join(second['joints'])}: only runs of arms with the same joints compare."
        )
    both = Comparison(_names(folders), (first, second))
    page = compare_page(both)
    write_text(out, render(page))
    return page.verdict.sentence, as_json(compare_content(both))


def _content(folder: Path) -> dict[str, Any]:
    path = folder / "run.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(
            f"{path} cannot be read ({error.strerror or error}): give two result folders of"
            " `ident run`."
        ) from error
    except ValueError as error:
        raise DataError(f"{path} is no JSON ({error}): run `ident run` again.") from error
    if isinstance(content, dict) and content.get("method") == "simulation":
        raise DataError(
            f"{path} holds servos that were identified by simulation, and two results of the"
            " regression are compared; `ident validate` tells how far each model is from a"
            " recording."
        )
    if not isinstance(content, dict) or "base_parameters" not in content:
        raise DataError(f"{path} is no result of `ident run`: it has no base parameters.")
    return content


def _names(folders: Sequence[Path]) -> tuple[str, str]:
    """The folders' names, told apart by as much of their paths as it takes."""
    if folders[0].name == folders[1].name:
        return str(folders[0]), str(folders[1])
    return folders[0].name, folders[1].name


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
    from ident.commands.report import compare_folders

    with file_written(out, force):
        sentence, text = compare_folders((first, second), out)
    typer.echo(text.rstrip() if as_json else f"{sentence}\n{out}")
    next_step("ident gap NEWER.mcap --model", first / "model.yaml")
