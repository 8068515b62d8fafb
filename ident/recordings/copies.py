"""Logs whose recorder asked faster than the source answered: readings stand there several times.

A copy holds every number of the message before it. Where copies come in runs of one length, the
recording's rate is that of the readings, and the copies tell nothing of the arm.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.signals.arrays import Array
from wamctl.arm.recording import Piece
from wamctl.arm.ros2.joint_series import JointSeries, rows_of

_REGULAR = 0.7
"""Share of the readings that come a usual step after the one before: lost samples are irregular."""

_NEAR = 0.25
"""A step is the usual one within this part of it."""

_LEAST = 1.5
"""Messages per reading from which a recorder repeats."""

_STOOD = 1.75
"""Usual steps without a new reading from which the arm stands still, and copies are readings."""


@dataclass
class _Last:
    """What is remembered from one piece of a log to the next."""

    row: Array | None = None
    stamp_ns: int = 0
    reading_ns: int = 0


class Readings:
    """The steps between messages that hold something new, as they come."""

    def __init__(self) -> None:
        self._last = _Last()
        self._steps: list[NDArray[np.int64]] = []

    def add(self, states: JointSeries) -> None:
        """The next messages of a log."""
        first = self._last.row is None
        before = self._last.reading_ns
        new, _ = _new(states, self._last)
        stamps = states.stamp_ns[new]
        if len(stamps):
            self._steps.append(np.diff(stamps) if first else np.diff(stamps, prepend=before))

    def period_ns(self, message_ns: float) -> float | None:
        """The usual step between readings [ns]; None where a message is a reading.

        Args:
            message_ns: the usual step between messages [ns].
        """
        steps = np.concatenate([np.empty(0, dtype=np.int64), *self._steps])
        if not len(steps):
            return None
        usual = float(np.median(steps))
        regular = np.mean(np.abs(steps - usual) <= _NEAR * usual)
        return usual if usual > _LEAST * message_ns and regular > _REGULAR else None


def readings_of(pieces: Callable[[], Iterator[Piece]], period_ns: float) -> Iterator[Piece]:
    """A log's pieces without the copies of its states.

    Args:
        pieces: reads the log.
        period_ns: the usual step between readings [ns].
    """
    last = _Last()
    for piece in pieces():
        if piece.states is None:
            yield piece
        else:
            kept = _kept(piece.states, last, period_ns)
            yield replace(piece, states=rows_of(piece.states, kept) if kept.any() else None)


def _kept(states: JointSeries, last: _Last, period_ns: float) -> NDArray[np.bool_]:
    """Which messages are readings: new ones, and one a period while nothing changes, shape (S,)."""
    before = (last.stamp_ns - last.reading_ns) / period_ns
    new, since_ns = _new(states, last)
    stood = np.maximum(np.floor(since_ns / period_ns - _STOOD + 1.0), 0.0)
    previous = np.concatenate([[max(np.floor(before - _STOOD + 1.0), 0.0)], stood[:-1]])
    return new | (stood > previous)


def _new(states: JointSeries, last: _Last) -> tuple[NDArray[np.bool_], Array]:
    """Which messages hold something new, and the time since the last that did [ns], shape (S,)."""
    rows = states.positions
    if states.effort is not None:
        rows = np.hstack([rows, states.effort])
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    new[0] = last.row is None or bool((rows[0] != last.row).any())
    stamps = states.stamp_ns
    readings = np.maximum.accumulate(np.where(new, stamps, last.reading_ns))
    last.row, last.stamp_ns, last.reading_ns = rows[-1], int(stamps[-1]), int(readings[-1])
    return new, (stamps - readings).astype(float)
