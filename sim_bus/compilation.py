"""A word to whoever waits while numba compiles, which it does once on a machine."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event


@contextmanager
def announced(sentence: str, tell: Callable[[str], None]) -> Iterator[None]:
    """Tell a sentence when something is first compiled in the block; nothing where all is cached.

    Args:
        sentence: what to tell.
        tell: takes it.
    """
    with event.install_listener("numba:compile", _First(lambda: tell(sentence))):
        yield


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
