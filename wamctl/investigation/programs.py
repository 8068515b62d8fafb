"""The other commands, as programs: each in a process that ends with this one."""

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Sequence

import typer

from wamctl.arm.errors import UserError
from wamctl.drives.one_master import handed_on

_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of Linux
_END_S = 30.0
_ADVICE = "Next: "

STOPPED = 5
"""Exit code of a run that a limit or the operator has ended."""


class ProgramError(UserError):
    """A command of an investigation has failed; its last line says why, its exit code counts."""

    def __init__(self, command: str, exit_code: int, said: str) -> None:
        self.exit_code = exit_code if exit_code > 0 else 1
        super().__init__(command, exit_code, said)
        self.command = command
        self.said = said

    def __str__(self) -> str:
        return f"{self.said or f'{self.command} was silent'} ({self.command}; --resume goes on)."


def call(module: str, arguments: Sequence[str], lock: int | None = None) -> None:
    """Run a command to its end; what it says goes to standard error.

    A signal to this process goes on to the command, which ends as it always does: a moving arm is
    braked first. It gets one, too, should this process be killed.

    Args:
        module: `wamctl.cli` or `ident.cli`.
        arguments: of the command.
        lock: of the bus, which the command shares with this process; None: it needs none.

    Raises:
        ProgramError: it failed.
    """
    name = " ".join((module.split(".")[0], arguments[0]))
    command = [sys.executable, "-P", "-c", f"from {module} import main; main()", *arguments]
    with subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=_bound,
        **({} if lock is None else handed_on(lock)),
    ) as process:
        try:
            said = _forwarded(process)
            code = process.wait()
        except BaseException as interrupt:
            process.send_signal(signal.SIGTERM)
            said = _forwarded(process) or "the operator stopped it"
            raise ProgramError(name, max(process.wait(_END_S), STOPPED), said) from interrupt
    if code:
        raise ProgramError(name, code, said)


def _forwarded(process: subprocess.Popen[str]) -> str:
    """The last line that a program says, while all are shown but its advice for a next command."""
    last = ""
    for line in process.stderr or ():
        if line.startswith(_ADVICE):
            continue
        typer.echo(f"  {line.rstrip()}", err=True)
        last = line.strip() or last
    return last.rstrip(".")


def _bound() -> None:
    """In the child: end when the parent is gone."""
    ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGTERM)
    if os.getppid() == 1:
        os._exit(1)
