"""Every command's help has an example that the program accepts; results also come as JSON."""

import re
import shlex

import pytest
import typer
from typer.core import TyperGroup

import ident.cli
import sim_bus.cli
import wamctl.cli

PROGRAMS = {"ident": ident.cli.app, "sim-bus": sim_bus.cli.app, "wamctl": wamctl.cli.app}
SHOWN_ON_A_TERMINAL = {("sim-bus", "serve"), ("wamctl", "home"), ("wamctl", "monitor")}
"""These have no result: they serve, ask, or show until they are ended."""


def commands() -> list[tuple[str, str]]:
    found = []
    for program, app in PROGRAMS.items():
        group = typer.main.get_command(app)
        assert isinstance(group, TyperGroup)
        with group.make_context(program, [], resilient_parsing=True) as context:
            found += [(program, name) for name in group.list_commands(context)]
    return found


def opened(program: str, arguments: list[str]):
    """The command and its context, parsed."""
    group = typer.main.get_command(PROGRAMS[program])
    assert isinstance(group, TyperGroup)
    with group.make_context(program, list(arguments)) as context:
        name, command, rest = group.resolve_command(context, arguments)
        assert command is not None
        return command, command.make_context(name, rest, parent=context)


@pytest.mark.parametrize(("program", "name"), commands())
def test_help_shows_an_example_that_is_accepted(program, name):
    group = typer.main.get_command(PROGRAMS[program])
    assert isinstance(group, TyperGroup)
    with group.make_context(program, [name, "--help"], resilient_parsing=True) as context:
        command = group.get_command(context, name)
    assert command is not None
    examples = re.findall(r"^\s*Example: (.+)$", command.help or "", re.M)
    assert len(examples) == 1
    words = shlex.split(examples[0])
    assert words[:2] == [program, name]
    opened(program, words[1:])


@pytest.mark.parametrize(("program", "name"), sorted(set(commands()) - SHOWN_ON_A_TERMINAL))
def test_results_come_as_json_where_asked_for(program, name):
    group = typer.main.get_command(PROGRAMS[program])
    assert isinstance(group, TyperGroup)
    with group.make_context(program, [], resilient_parsing=True) as context:
        command = group.get_command(context, name)
    assert command is not None
    assert "--json" in {option for p in command.params for option in p.opts}
