"""Commands that the READMEs show exist, and take the options that stand there."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup

import ident.cli
import sim_bus.cli
import wamctl.cli

PROJECT = Path(__file__).parents[2]
APPS = {
    "ident": typer.main.get_command(ident.cli.app),
    "sim-bus": typer.main.get_command(sim_bus.cli.app),
    "wamctl": typer.main.get_command(wamctl.cli.app),
}
(USAGE_ERROR,) = (c for c in typer.BadParameter.__bases__ if issubclass(c, Exception))
"""What all refusals of a command line are; typer gives it no name of its own."""

OPTION = r"--[a-z]+ [^-`\s]"
"""Without an option and its value, it is a command's name rather than one to be typed."""

COMMAND = re.compile(rf"(?:^ *|`)((?:wamctl|ident|sim-bus) [a-z]+ [^`\n]*{OPTION}[^`\n]*)", re.M)


def shown() -> list[tuple[str, str]]:
    """README and command, of blocks and of words in text."""
    listed = subprocess.run(
        ["git", "ls-files", "*README.md", "docs/*.md"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    )
    names = listed.stdout.split()
    return [(n, c) for n in names for c in COMMAND.findall((PROJECT / n).read_text("utf-8"))]


def parse(command: str) -> None:
    """Parses a command as its program would, without running it.

    Raises:
        USAGE_ERROR: the program would refuse it.
    """
    program, *arguments = shlex.split(command, comments=True)
    group = APPS[program]
    assert isinstance(group, TyperGroup)
    with group.make_context(program, list(arguments)) as context:
        name, found, rest = group.resolve_command(context, arguments)
        assert found is not None
        found.make_context(name, rest, parent=context)


def test_every_command_is_accepted() -> None:
    commands = shown()
    assert {"ident", "wamctl", "sim-bus"} == {c.split()[0] for _, c in commands}
    refused = []
    for readme, command in commands:
        try:
            parse(command)
        except USAGE_ERROR as error:
            refused.append(f"{readme}: {command}: {error}")
    assert refused == []


@pytest.mark.parametrize(
    ("command", "refusal"),
    [
        ("ident rum log.mcap", "No such command 'rum'"),
        ("ident run log.mcap --robott arm.urdf", "No such option: --robott"),
        ("ident export model.yaml --to sdf --out arm.sdf", "sdf"),
    ],
)
def test_what_a_program_would_refuse_is_seen(command: str, refusal: str) -> None:
    with pytest.raises(USAGE_ERROR) as error:
        parse(command)
    assert refusal in str(error.value)
