"""Functions compiled by numba, by one process at a time, and a word to whoever waits for it.

Machine code is kept on disk, so that compilation happens once on a machine. But numba tells the
others that a function's code is there before it has written it. A process that starts a little
later, after an upgrade or an edit, can thus read the code of before, or that for other types of
arguments, and compute with it. So each compilation, from the look on disk to the last byte
written, holds a lock that all processes of this installation share; the others then read what the
first has compiled.
"""

import fcntl
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import IO

from numba import njit
from numba.core import event

_LONGEST_WAIT_S = 120.0

compiled = partial(njit, cache=True)
"""Decorator of a compiled function, as `numba.njit` is."""


class _OneProcess(event.Listener):
    """Holds the lock while numba holds its own, which only the threads of a process share."""

    def __init__(self) -> None:
        self._of = _Held()

    def on_start(self, event: event.Event) -> None:
        """This thread is about to take numba's lock, perhaps once more."""
        if self._of.depth == 0:
            self._of.file = open(__file__, "rb")
            _wait_for(self._of.file)
        self._of.depth += 1

    def on_end(self, event: event.Event) -> None:
        """It has given it back."""
        self._of.depth -= 1
        if self._of.depth == 0 and self._of.file is not None:
            with suppress(OSError):  # where files have no locks
                fcntl.flock(self._of.file, fcntl.LOCK_UN)  # a forked process has the file, too
            self._of.file.close()


class _Held(threading.local):
    """How often a thread has taken the lock, and the file that it holds."""

    depth = 0
    file: IO[bytes] | None = None


def _wait_for(file: IO[bytes]) -> None:
    """Take the lock: not beyond a process that was suspended, nor where files have no locks."""
    end = time.monotonic() + _LONGEST_WAIT_S
    while time.monotonic() < end:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.01)
        except OSError:
            return
        else:
            return


event.register("numba:compiler_lock", _OneProcess())


@contextmanager
def compilation_announced(what: str) -> Iterator[None]:
    """Say so on stderr when something is first compiled in the block; silent where all is cached.

    Args:
        what: what is compiled, to begin the sentence with.
    """
    with event.install_listener("numba:compile", _First(lambda: _say(what))):
        yield


def _say(what: str) -> None:
    from wamctl.arm.command_line import is_quiet  # it loads Typer, a third of a second

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
