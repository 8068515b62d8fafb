"""Processes that run beside the loop, spoken to in lines; no wait for one of them is unbounded."""

import os
import select
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

_KILLED_S = 1.0


class ChildProcess:
    """A module of this project as a process of its own.

    It is started with Python's `-P`, so that no file of the current folder is imported, and in a
    session of its own, so that a Ctrl-C at the terminal does not reach it.

    Args:
        module: the module, with its package.
        arguments: of the command line.
        descriptors: what it inherits.
        quiet: nothing that it says on standard error reaches the terminal.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str],
        descriptors: Sequence[int],
        quiet: bool = False,
    ) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL if quiet else None,
            bufsize=0,
            pass_fds=tuple(descriptors),
            start_new_session=True,
        )
        pipes = self._process.stdin, self._process.stdout
        self._input, self._output = (pipe.fileno() for pipe in pipes if pipe is not None)
        os.set_blocking(self._input, False)
        self._heard = b""

    @property
    def process_id(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def status(self) -> int | None:
        """Its exit status; None while it runs."""
        return self._process.poll()

    def tell(self, line: str, patience_s: float) -> bool:
        """Give it a line; False if it does not take it in time, or has ended."""
        rest, end_s = line.replace("\n", " ").encode() + b"\n", time.monotonic() + patience_s
        while rest:
            left_s = end_s - time.monotonic()
            if left_s <= 0 or not select.select([], [self._input], [], left_s)[1]:
                return False
            try:
                rest = rest[os.write(self._input, rest) :]
            except BlockingIOError:
                continue
            except OSError:
                return False  # it has ended; its exit status tells
        return True

    def answer(self, patience_s: float) -> str:
        """Its next line without white space at the ends; empty if none comes in time."""
        end_s = time.monotonic() + patience_s
        while b"\n" not in self._heard:
            left_s = max(0.0, end_s - time.monotonic())
            if not select.select([self._output], [], [], left_s)[0]:
                break
            more = os.read(self._output, 1 << 16)
            if not more:
                break
            self._heard += more
        line, _, self._heard = self._heard.partition(b"\n")
        return line.decode(errors="replace").strip()

    def end(self, patience_s: float) -> int | None:
        """Close its input and wait; returns its exit status, None if it had to be killed."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            return self._process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            with suppress(subprocess.TimeoutExpired):  # it hangs in the kernel, and ends later
                self._process.wait(_KILLED_S)
            return None
        finally:
            if self._process.stdout is not None:
                self._process.stdout.close()
