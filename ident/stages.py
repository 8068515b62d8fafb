"""What a command is doing, for whoever waits at a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

Tell = Callable[[str], None]
"""Called with a few words when a step begins."""


def silent(what: str) -> None:
    """Tells nobody."""


@contextmanager
def shown() -> Iterator[Tell]:
    """Shows the step and the time since the start while the block runs.

    Nothing is shown where standard error is no terminal.
    """
    console = Console(stderr=True)
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    hidden = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as progress:
        task = progress.add_task("starting", total=None)
        yield lambda what: progress.update(task, description=what)
