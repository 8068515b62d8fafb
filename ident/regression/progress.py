"""What a command is doing, for whoever waits at a terminal."""

import time
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

_LONG_S = 30.0


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

    Where standard error is no terminal, each step is a line of its own, once half a minute has
    gone by.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield Lines(after_s=_LONG_S).tell
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
        BarColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=is_quiet()) as progress:
        task = progress.add_task("starting", total=None)

        def tell(what: str, share: float | None = None) -> None:
            if what != progress.tasks[0].description or not share:
                progress.reset(task, total=None, description=what)
            if share is not None:
                progress.update(task, total=1.0, completed=share)

        yield tell


class Lines:
    """Steps of long work on stderr, one line each with the seconds since its beginning.

    Args:
        after_s: steps that begin sooner are not told [s].
    """

    def __init__(self, after_s: float = 0.0) -> None:
        self._console, self._after_s = Console(stderr=True, quiet=is_quiet()), after_s
        self._began, self._last = time.monotonic(), ""

    def tell(self, what: str, share: float | None = None) -> None:
        """A step, told once, when it begins."""
        seconds = time.monotonic() - self._began
        if what != self._last and seconds >= self._after_s:
            self._last = what
            line = f"{seconds:5.1f} s  {what}"
            self._console.print(line, markup=False, highlight=False, soft_wrap=True)
