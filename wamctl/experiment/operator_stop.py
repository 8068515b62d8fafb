"""The operator's ways to stop the arm: Ctrl-C and other signals, and any key at the terminal."""

import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """Whether, and how, the operator asked to stop; call it once a cycle."""

    def __init__(self) -> None:
        self._reason: str | None = None
        self._keyboard: int | None = None

    def __call__(self) -> str | None:
        """How the operator asked to stop; None while he has not."""
        keyboard = self._keyboard
        if keyboard is not None and select.select([keyboard], [], [], 0)[0]:
            os.read(keyboard, 64)
            self._reason = self._reason or "the operator pressed a key"
        return self._reason

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        """Handler of signals: a second one changes nothing, since the arm is stopping already."""
        self._reason = self._reason or f"the operator stopped it ({signal.Signals(number).name})"

    @contextmanager
    def listening(self) -> Iterator["StopRequest"]:
        """Listen to signals, and to the keyboard where standard input is a terminal."""
        before = {number: signal.signal(number, self.on_signal) for number in _SIGNALS}
        try:
            with _single_keys() as self._keyboard:
                yield self
        finally:
            self._keyboard = None
            for number, handler in before.items():
                signal.signal(number, handler)


@contextmanager
def _single_keys() -> Iterator[int | None]:
    """Descriptor of the terminal, which then gives every key at once; None without a terminal."""
    if not sys.stdin.isatty():
        yield None
        return
    keyboard = sys.stdin.fileno()
    settings = termios.tcgetattr(keyboard)
    tty.setcbreak(keyboard)
    try:
        yield keyboard
    finally:
        termios.tcsetattr(keyboard, termios.TCSADRAIN, settings)
