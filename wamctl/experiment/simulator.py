"""The simulated arm as a child process, on a private socket: what `--bus sim` means."""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wamctl.drives.bus import Channel
from wamctl.errors import BusError

_END_S = 10.0


@contextmanager
def simulated_arm(
    config: Path, seed: int, lockstep: bool, truth: Path | None = None
) -> Iterator[Channel]:
    """A running simulated arm, and the bus on which its drives are.

    Args:
        config: the arm's file.
        seed: which arm, and which chance.
        lockstep: its time advances by one period a SYNC.
        truth: where it is to write its true parameters.

    Raises:
        BusError: it does not start.
    """
    with tempfile.TemporaryDirectory(prefix="wamctl-") as folder:
        channel = Channel("simbus", str(Path(folder) / "bus"))
        arguments = [_program(), "serve", "--config", str(config), "--bus", str(channel)]
        arguments += ["--seed", str(seed), "--stop-with-stdin"]
        arguments += ["--lockstep"] if lockstep else []
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
    ready = process.stdout.readline() if process.stdout else ""
    if not ready:
        said = process.stderr.read().strip().splitlines() if process.stderr else []
        raise BusError(f"The simulated arm did not start: {said[-1] if said else 'it was silent'}")


def _end(process: subprocess.Popen[str]) -> None:
    if process.stdin:
        process.stdin.close()
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
