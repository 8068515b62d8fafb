"""The process that shows the operator what the loop does, so that no terminal ever delays it.

Started as `python -m wamctl.telemetry.display DESCRIPTOR JOINTS`; it reads the
ring's header ten times a second and ends with its input.
"""

import select
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from wamctl.arm.command_line import is_quiet
from wamctl.telemetry import ring as shared
from wamctl.telemetry.child_process import ChildProcess
from wamctl.telemetry.status import Phase

_INTERVAL_S = 0.1
_END_S = 2.0


@contextmanager
def display(descriptor: int, joints: int) -> Iterator[None]:
    """Progress for the operator while the block runs, where standard error is a terminal.

    Args:
        descriptor: the ring's.
        joints: number of joints.
    """
    if is_quiet() or not sys.stderr.isatty():
        yield
        return
    child = ChildProcess("wamctl.telemetry.display", [str(descriptor), str(joints)], [descriptor])
    try:
        yield
    finally:
        child.end(_END_S)


def main() -> None:
    """Show one run."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the operator's stop is for the loop
    header = shared.attach(int(sys.argv[1]), int(sys.argv[2])).header
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} cycles"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        phase, task = -1, progress.add_task("wake", total=1)
        while not select.select([sys.stdin], [], [], _INTERVAL_S)[0]:
            now, done, total = (
                int(header[place]) for place in (shared.PHASE, shared.DONE, shared.TOTAL)
            )
            if now != phase:
                phase = now
                progress.reset(task, description=Phase(now).word)
            progress.update(task, completed=done, total=max(1, total))


if __name__ == "__main__":
    main()
