"""What a command is doing, for whoever waits at a terminal."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from wamctl.arm.command_line import is_quiet


class Tell(Protocol):
    """Called with a few words when a step begins, and again as it goes on."""

    def __call__(self, what: str, share: float | None = None) -> None:
        """What is being done, and the share of it that is done, where that is known."""
        ...


def silent(what: str, share: float | None = None) -> None:
    """Tells nobody."""


@contextmanager
def shown() -> Iterator[Tell]:
    """Shows the step, the time that it has taken, and how long it will still take.

    Nothing is shown where standard error is no terminal.
    """
    console = Console(stderr=True)
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
        BarColumn(),
        TimeRemainingColumn(),
    )
    hidden = is_quiet() or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as progress:
        task = progress.add_task("starting", total=None)

        def tell(what: str, share: float | None = None) -> None:
            if what != progress.tasks[0].description or not share:
                progress.reset(task, total=None, description=what)
            if share is not None:
                progress.update(task, total=1.0, completed=share)

        yield tell
