"""How a command ends: with one sentence, and the exit code of what stopped it."""

import logging
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from wamctl.arm.errors import UserError
from wamctl.commands.text_output import say
from wamctl.errors import SafetyStopError, UsageError
from wamctl.experiment.operator_stop import Interrupted, StopRequest


@contextmanager
def reported(debug: bool) -> Iterator[StopRequest]:
    """End the command with one sentence and its exit code."""
    if not debug:
        logging.getLogger("canopen").addHandler(logging.NullHandler())
        logging.getLogger("canopen").propagate = False
    try:
        with StopRequest().in_command() as operator:
            try:
                yield operator
            except typer.Abort as error:
                say("The operator gave no answer, so that nothing was done.")
                raise typer.Exit(UsageError.exit_code) from error
            except Interrupted as error:
                say(str(error))
                raise typer.Exit(SafetyStopError.exit_code) from error
            except UserError as error:
                if debug:
                    traceback.print_exc()
                say(str(error))
                raise typer.Exit(error.exit_code) from error
    except KeyboardInterrupt as error:  # between the handlers of two stages
        say("The operator stopped it.")
        raise typer.Exit(SafetyStopError.exit_code) from error
