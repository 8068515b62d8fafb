"""The operator's word before the arm moves (`wamctl excite`)."""

import sys

import typer

from wamctl.errors import UsageError
from wamctl.experiment.preflight import Prepared
from wamctl.experiment.session import Connection


def confirm_by_name(prepared: Prepared, given: str, connection: Connection) -> None:
    """Let the operator type the arm's name, unless the arm is the simulated one of this project.

    Args:
        prepared: the checked configuration.
        given: the name that was given with the command; empty for none.
        connection: the drives that were found.

    Raises:
        UsageError: another name, or none.
    """
    name, channel = prepared.arm.file.arm, connection.channel
    for note in connection.notes:
        typer.echo(f"note: {note}", err=True)
    if channel.is_embedded:
        return
    if not given and sys.stdin.isatty():
        seconds = prepared.excitation.t[-1]
        typer.echo(
            f"The arm {name} on {channel} will move for about {seconds:.0f} s. Keep everybody out "
            "of its reach, and a hand on the emergency stop. Any key stops it.",
            err=True,
        )
        given = typer.prompt("Type the arm's name to go on", err=True)
    if given != name:
        raise UsageError(
            f"The arm does not move: {given!r} is not its name, which the operator must type or "
            f"give with --yes-move-the-arm {name}."
        )


def tests_motors(name: str, skipped: str) -> bool:
    """Whether the motors are to be tested by a small motion first.

    Args:
        name: the arm's.
        skipped: the name that was given to skip the test; empty for none.

    Raises:
        UsageError: another name.
    """
    if skipped and skipped != name:
        raise UsageError(
            f"The test of the motors is not skipped: {skipped!r} is not the arm's name {name!r}, "
            "which --skip-test-motion must give."
        )
    return not skipped
