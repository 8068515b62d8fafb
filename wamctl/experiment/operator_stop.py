"""The operator's ways to stop the arm: any key at the terminal, and every deadly signal."""

import os
import select
import signal
import sys
import termios
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import Enum
from types import FrameType

_UNSTOPPABLE = {signal.SIGKILL, signal.SIGSTOP}
_OF_THE_PROCESSOR = {signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}
_ENDING_NOTHING = {signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH}
_ERRORS_IN_PYTHON = {signal.SIGPIPE, signal.SIGXFSZ}
_TERMINAL = {signal.SIGTTIN, signal.SIGTTOU}
"""A process in the background must not be suspended for looking at its terminal."""
_STOPPING = signal.valid_signals() - (
    _UNSTOPPABLE | _OF_THE_PROCESSOR | _ENDING_NOTHING | _ERRORS_IN_PYTHON | _TERMINAL
)
"""Signals that end or suspend a process and can be caught, those of real time among them."""


class Interrupted(BaseException):
    """A signal came while nothing moved; the message is the whole sentence."""


class _Stage(Enum):
    SETTING_UP = 0
    LISTENING = 1
    ENDING = 2


class StopRequest:
    """Whether, and how, the operator asked to stop; call it once a cycle.

    Before the experiment a signal raises `Interrupted`; during it the arm is braked first; at its
    end nothing more can be stopped, so that further signals change nothing.
    """

    def __init__(self) -> None:
        self._stage = _Stage.SETTING_UP
        self._reason: str | None = None
        self._keyboard: int | None = None

    def __call__(self) -> str | None:
        """How the operator asked to stop; None while he has not."""
        keyboard = self._keyboard
        if keyboard is not None and select.select([keyboard], [], [], 0)[0]:
            pressed = b""
            with suppress(OSError):  # of a terminal that was closed
                pressed = os.read(keyboard, 64)
            if not pressed:
                self._keyboard = None
            how = "the operator pressed a key" if pressed else "the terminal was closed"
            self._reason = self._reason or how
        return self._reason

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        """Handler of signals: a second one changes nothing, since the arm is stopping already."""
        name = next((s.name for s in signal.Signals if s == number), f"signal {number}")
        if self._stage is _Stage.SETTING_UP:
            self._stage, self._reason = _Stage.ENDING, name
            raise Interrupted(f"The operator stopped it ({name}) while no drive was enabled.")
        self._reason = self._reason or f"the operator stopped it ({name})"

    @contextmanager
    def in_command(self) -> Iterator["StopRequest"]:
        """Take all signals from the start of a command to its end.

        Once the operator has asked to stop, signals are ignored to the end of the process: Python
        takes its own handlers away while it ends, so that one more would kill it there.
        """
        before = self._take_signals()
        try:
            yield self
        finally:
            ignored: dict[int, object] = dict.fromkeys(before, signal.SIG_IGN)
            _give_back(before if self._reason is None else ignored)

    @contextmanager
    def listening(self) -> Iterator["StopRequest"]:
        """Listen to signals, and to the keyboard where standard input is a terminal."""
        before = self._take_signals()
        self._stage = _Stage.LISTENING
        try:
            with _single_keys() as self._keyboard:
                yield self
        finally:
            self._keyboard = None
            self._stage = _Stage.ENDING
            _give_back(before)

    def _take_signals(self) -> dict[int, object]:
        before: dict[int, object] = {n: signal.signal(n, self.on_signal) for n in _STOPPING}
        return before | {n: signal.signal(n, signal.SIG_IGN) for n in _TERMINAL}


def _give_back(handlers: dict[int, object]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)  # pyright: ignore[reportArgumentType]


@contextmanager
def _single_keys() -> Iterator[int | None]:
    """Descriptor of the terminal, which then gives every key at once; None without a terminal.

    Keys that usually mean a signal, such as Ctrl-C and Ctrl-Z, or hold the output up (Ctrl-S), are
    keys like all others.
    """
    if not sys.stdin.isatty():
        yield None
        return
    keyboard = sys.stdin.fileno()
    settings = termios.tcgetattr(keyboard)
    single = termios.tcgetattr(keyboard)
    single[0] &= ~(termios.IXON | termios.IXOFF)
    single[3] &= ~(termios.ICANON | termios.ECHO | termios.ISIG | termios.IEXTEN)
    single[6][termios.VMIN], single[6][termios.VTIME] = 1, 0
    termios.tcsetattr(keyboard, termios.TCSANOW, single)
    try:
        yield keyboard
    finally:
        with suppress(termios.error):  # of a terminal that was closed
            termios.tcflush(keyboard, termios.TCIFLUSH)
            termios.tcsetattr(keyboard, termios.TCSANOW, settings)
