"""Options that are fields of a dataclass are options of the command."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from typer.testing import CliRunner

from wamctl.arm.command_line import grouped


@dataclass(frozen=True)
class Motion:
    """Options of a command."""

    speed: Annotated[float, typer.Option("--speed", help="Speed [rad/s].")]
    joints: Annotated[list[int] | None, typer.Option("--joint")] = None


@grouped
def command(
    log: Annotated[Path, typer.Argument(metavar="LOG")],
    motion: Motion,
    force: Annotated[bool, typer.Option("--force")] = False,
) -> None:
    """What it does."""
    typer.echo(f"{log} {motion} {force}")


def said(*words: str) -> str:
    app = typer.Typer(rich_markup_mode=None)
    app.command()(command)
    return CliRunner().invoke(app, list(words)).output


def test_fields_are_options_with_their_defaults():
    assert said("a.mcap", "--speed", "2") == "a.mcap Motion(speed=2.0, joints=None) False\n"
    given = said("--joint", "1", "--speed", "2", "a.mcap", "--force", "--joint", "3")
    assert given == "a.mcap Motion(speed=2.0, joints=[1, 3]) True\n"


def test_help_shows_them_and_a_missing_one_is_told():
    text = said("--help")
    assert "What it does." in text
    assert "Speed [rad/s]." in text
    assert "Missing option '--speed'" in said("a.mcap")
