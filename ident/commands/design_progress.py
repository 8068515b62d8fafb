"""How far a design is, on stderr."""

import time

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from ident.excitation.optimisation.evaluate import UNSEEN, Candidate
from ident.excitation.settings import DesignSettings
from wamctl.arm.command_line import is_quiet


class Progress:
    """A bar over the time to search, with the best design so far; Ctrl-C keeps that one.

    It appears with the first report: what is refused before the search has no bar.
    """

    def __init__(self, settings: DesignSettings) -> None:
        self._settings = settings
        self._began = time.monotonic()
        self._bar = Bar(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True, quiet=is_quiet()),
        )
        self._task = self._bar.add_task("searching", total=settings.time_s)

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_error: object) -> None:
        if self._bar.live.is_started:
            self._bar.stop()

    def report(self, best: Candidate | None) -> None:
        """Move the bar; name the best design where there is a new one."""
        self._bar.start()
        seconds = time.monotonic() - self._began
        self._bar.update(self._task, completed=min(seconds, self._settings.time_s))
        if best is None:
            return
        words = f"condition number {best.condition_number:.2f}"
        if self._settings.objective != "condition" and best.value < UNSEEN:
            words += f", objective {best.value:.3f}"
        self._bar.update(self._task, description=words)
        if not self._bar.console.is_terminal:
            self._bar.console.print(f"{seconds:.0f} s: {words}")
