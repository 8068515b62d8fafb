"""A word to whoever waits while numba compiles, which it does once on a machine."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event

from wamctl.arm.command_line import is_quiet


@contextmanager
def compilation_announced(what: str) -> Iterator[None]:
    """Say so on stderr when something is first compiled in the block; silent where all is cached.

    Args:
        what: what is compiled, to begin the sentence with.
    """
    with event.install_listener("numba:compile", _First(lambda: _say(what))):
        yield


def _say(what: str) -> None:
    if is_quiet():
        return
    sys.stderr.write(
        f"note: {what} is being compiled, which happens once on a machine and takes about half a "
        "minute.\n"
    )
    sys.stderr.flush()


class _First(event.Listener):
    """Calls a function at the first compilation."""

    def __init__(self, call: Callable[[], None]) -> None:
        self._call: Callable[[], None] | None = call

    def on_start(self, event: event.Event) -> None:
        """A compilation begins."""
        if self._call is not None:
            self._call()
            self._call = None

    def on_end(self, event: event.Event) -> None:
        """It ends."""
