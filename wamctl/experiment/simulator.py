"""The simulated arm as a child process, on a private socket: what `--bus sim` means."""

import secrets
import select
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wamctl.drives.bus import Channel
from wamctl.errors import BusError, SimulatedArmError

_END_S = 10.0
_NOTE = "note: "  # begins what it says for the operator while it starts


@contextmanager
def simulated_arm(
    config: Path,
    seed: int,
    lockstep: bool,
    hidden: str | None = None,
    truth: Path | None = None,
) -> Iterator[Channel]:
    """A running simulated arm, and the bus on which its drives are.

    Args:
        config: the arm's file.
        seed: which arm, and which chance.
        lockstep: its time advances by one period a SYNC.
        hidden: effects that it carries in secret: a shipped name or a file; None: none.
        truth: where it is to write its true parameters.

    Raises:
        BusError: its program is not there.
        SimulatedArmError: it does not start.
    """
    with _private_folder() as folder:
        channel = Channel("simbus", str(folder / "bus"))
        arguments = [_program(), "serve", "--config", str(config), "--bus", str(channel)]
        arguments += ["--seed", str(seed), "--stop-with-stdin"]
        arguments += ["--lockstep"] if lockstep else []
        arguments += ["--hidden", hidden] if hidden else []
        arguments += ["--truth", str(truth)] if truth else []
        process = subprocess.Popen(
            arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # a Ctrl-C at the terminal must not reach it
        )
        with process:
            try:
                _wait_until_ready(process)
                yield channel
            finally:
                _end(process)


@contextmanager
def _private_folder() -> Iterator[Path]:
    """A folder of this process alone; an interrupt right after its making leaves none behind."""
    folder = Path(tempfile.gettempdir()) / f"wamctl-{secrets.token_hex(8)}"
    try:
        folder.mkdir(mode=0o700)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def shipped_effects() -> str:
    """Names, joints and sizes of the hidden effects that are shipped, one a line.

    Raises:
        BusError: the program sim-bus is not there.
        SimulatedArmError: it cannot list them.
    """
    asked = subprocess.run([_program(), "hidden"], capture_output=True, text=True, check=False)
    if asked.returncode:
        raise SimulatedArmError("cannot list its effects", asked.stderr, asked.returncode)
    return asked.stdout.rstrip()


def _program() -> str:
    beside = Path(sys.executable).with_name("sim-bus")
    found = str(beside) if beside.exists() else shutil.which("sim-bus")
    if found is None:
        raise BusError(
            f"`--bus sim` needs the program sim-bus, which is neither in {beside.parent} nor on the"
            " PATH: install this project with its three commands."
        )
    return found


def _wait_until_ready(process: subprocess.Popen[str]) -> None:
    if process.stdout is None or process.stderr is None:
        raise SimulatedArmError("did not start", "it has no output", BusError.exit_code)
    said = []
    while process.stdout not in select.select([process.stdout, process.stderr], [], [])[0]:
        said.append(process.stderr.readline())
        if said[-1].startswith(_NOTE):
            sys.stderr.write(said[-1])
    if not process.stdout.readline():
        said.append(process.stderr.read())
        raise SimulatedArmError("did not start", "".join(said), process.wait(_END_S))


def _end(process: subprocess.Popen[str]) -> None:
    if process.stdin:
        process.stdin.close()
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
