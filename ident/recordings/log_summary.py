"""A first pass over a log: its joints, rate, holes, and how far each joint moves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from ident.recordings.copies import Readings, readings_of
from ident.recordings.even_clock import even_clock, evenly_stamped
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Piece
from wamctl.arm.ros2.joint_series import Stamps

GAP_PERIODS = 10
"""A hole of more periods than this is never bridged."""

_MOST_HOLES = 1000
_MOST_STEPS = 100_000
_LOSSY_STEP = 1.75  # median steps from which one holds a missing sample: near two
"""The period is the median of so many steps between stamps at most, evenly thinned."""


_MOVES = 0.01
"""Range of a position from which its joint tells how even a clock is [rad] or [m]."""

_SMALL_BYTES = 64e6
"""Logs of so many bytes of numbers at most are kept as they were read, so as to be read once."""


class LogSource(Protocol):
    """What can be read from its start as often as needed: a file, or a recording in memory."""

    def pieces(self) -> Iterator[Piece]:
        """All of it in the order of time."""
        ...


@dataclass(frozen=True)
class LogSummary:
    """What a log holds.

    Attributes:
        name: the log's name.
        log: as it was given.
        pieces: reads it again; small ones from memory.
        joint_names: of its columns, N of them.
        attachments: files inside the log.
        first_ns: its first stamp [ns].
        period_s: the usual step of its stamps [s].
        spans_s: first and last instant since the first stamp of each unbroken stretch [s].
        bridged_s: first and last instant of longer steps inside these stretches, the longest [s].
        low, high: range of the positions [rad], shape (N,) each.
        repeated: number of samples with the stamp of the one before them.
        lost: number of samples that are missing by the stamps, those of holes among them.
        copies: messages in the log to each reading, where its recorder was faster than its source
            (1: each is one); `pieces` leaves the copies out.
        jitter_s: by how much its stamps were off an even clock that its samples were taken by,
            rms [s]; `pieces` has the instants of that. Zero where the stamps are as they were.
        complete: whether the log ends as its writer closed it, not cut off.
        measured, commanded: whether there is a torque of that kind.
        reference: whether there is a wanted motion of these joints.
    """

    name: str
    log: LogSource
    pieces: Callable[[], Iterator[Piece]]
    joint_names: tuple[str, ...]
    attachments: dict[str, bytes]
    first_ns: int
    period_s: float
    spans_s: tuple[tuple[float, float], ...]
    bridged_s: tuple[tuple[float, float], ...]
    low: Array
    high: Array
    repeated: int
    lost: int
    copies: float
    jitter_s: float
    complete: bool
    measured: bool
    commanded: bool
    reference: bool


def summarise_log(log: LogSource, name: str) -> LogSummary:
    """The summary of a log.

    Args:
        log: the file or recording.
        name: what to call it.

    Raises:
        DataError: a log that cannot be read, or whose stamps run backwards.
    """
    found, readings_ns = _summary(log, log.pieces, name)
    if readings_ns is not None:
        pieces = partial(readings_of, found.pieces, readings_ns)
        copies = readings_ns * 1e-9 / found.period_s
        found = replace(_summary(log, pieces, name)[0], copies=copies)
    if found.lost or found.repeated or found.commanded:
        return found
    moving = found.high - found.low > _MOVES
    clock = even_clock(found.pieces, moving) if moving.any() else None
    if clock is None:
        return found
    even = _summary(log, partial(evenly_stamped, found.pieces, clock), name)[0]
    return replace(even, copies=found.copies, jitter_s=clock.jitter_s)


def _summary(
    log: LogSource, pieces: Callable[[], Iterator[Piece]], name: str
) -> tuple[LogSummary, float | None]:
    """The summary of a log as it is read, and the step between readings where it holds copies."""
    stamps, readings, joints = _Stamps(name), Readings(), ()
    low, high = np.array(np.inf), np.array(-np.inf)
    attachments: dict[str, bytes] = {}
    measured = commanded = False
    complete = True
    wanted, widths = 0, set()
    kept, size = [], 0
    for piece in pieces():
        size += _bytes(piece)
        kept.append(piece)
        if size > _SMALL_BYTES:
            kept.clear()
        attachments |= piece.attachments
        complete = complete and piece.complete
        if piece.states is not None:
            joints = piece.states.joint_names
            stamps.add(piece.states.stamp_ns)
            readings.add(piece.states)
            low = np.minimum(low, piece.states.positions.min(axis=0))
            high = np.maximum(high, piece.states.positions.max(axis=0))
            measured = piece.states.effort is not None
        if piece.commands is not None:
            commanded = piece.commands.effort is not None
        if piece.reference is not None:
            wanted += len(piece.reference.stamp_ns)
            widths.add(piece.reference.q.shape[1])
    found = LogSummary(
        name=name,
        log=log,
        pieces=partial(iter, kept) if size <= _SMALL_BYTES else pieces,
        joint_names=joints,
        attachments=attachments,
        first_ns=stamps.first,
        period_s=stamps.period_ns * 1e-9,
        spans_s=stamps.spans_s(),
        bridged_s=stamps.bridged_s(),
        low=low,
        high=high,
        repeated=stamps.repeated,
        lost=stamps.lost,
        copies=1.0,
        jitter_s=0.0,
        complete=complete,
        measured=measured,
        commanded=commanded,
        reference=wanted > 1 and widths == {len(joints)},
    )
    return found, readings.period_ns(stamps.period_ns)


def _bytes(piece: Piece) -> int:
    """What the numbers of a piece take in memory."""
    series = (piece.states, piece.commands, piece.reference)
    numbers = [x for s in series if s is not None for x in vars(s).values()]
    return sum(x.nbytes for x in numbers if isinstance(x, np.ndarray))


class _Stamps:
    """What is remembered of the stamps seen so far."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._steps = np.empty(0, dtype=np.int64)
        self._stride = 1
        self._longest = np.empty((0, 2), dtype=np.int64)
        self._last = self._count = 0
        self.first = self.repeated = 0

    def add(self, stamp_ns: Stamps) -> None:
        """The next stamps.

        Raises:
            DataError: they run backwards.
        """
        if not self._count:
            self.first = self._last = int(stamp_ns[0])
            self.repeated = -1
        ends = np.concatenate([[self._last], stamp_ns])
        steps = np.diff(ends)
        if (steps < 0).any():
            at = int(np.argmax(steps < 0))
            raise DataError(
                f"{self._name}: the stamp of sample {self._count + at} lies"
                f" {-steps[at] * 1e-9:g} s before the one ahead of it; sort or repair the"
                " recording."
            )
        self.repeated += int((steps == 0).sum())
        self._count += len(steps)
        self._last = int(stamp_ns[-1])
        self._longest = _longest(np.concatenate([self._longest, _pairs(ends)]))
        self._steps = np.concatenate([self._steps, steps[steps > 0][:: self._stride]])
        while len(self._steps) > _MOST_STEPS:
            self._steps, self._stride = self._steps[::2], 2 * self._stride

    @property
    def period_ns(self) -> float:
        """The median step [ns], or the mean one of an even clock that is told in whole ones.

        Raises:
            DataError: fewer than two different stamps.
        """
        if not len(self._steps):
            raise DataError(
                f"{self._name} holds {self._count} samples with one and the same stamp, from which"
                " nothing can be learned: write the sampling instants into the headers' stamps."
            )
        usual, whole = float(np.median(self._steps)), self._last - self.first
        if np.ptp(self._steps) <= 1 and round(whole / usual) == self._count - 1:
            return whole / (self._count - 1)
        return usual

    @property
    def lost(self) -> int:
        """Number of samples that are missing between the first stamp and the last.

        They are counted by the mean of the steps that hold no missing sample, not by the median,
        which a coarse clock rounds: steps of 10 and 12 ms are no losses at 10 ms.
        """
        whole = self._steps[self._steps < _LOSSY_STEP * self.period_ns]
        wanted = round((self._last - self.first) / whole.mean()) + 1
        return max(wanted - (self._count - self.repeated), 0)

    def spans_s(self) -> tuple[tuple[float, float], ...]:
        """The unbroken stretches [s].

        Raises:
            DataError: more holes than are remembered.
        """
        ends = self._longest
        holes = ends[ends[:, 1] - ends[:, 0] > GAP_PERIODS * self.period_ns]
        if len(holes) == _MOST_HOLES:
            raise DataError(f"{self._name} has {_MOST_HOLES} holes or more; repair the recording.")
        starts, stops = [self.first, *holes[:, 1]], [*holes[:, 0], self._last]
        return self._since_first(np.column_stack([starts, stops]))

    def bridged_s(self) -> tuple[tuple[float, float], ...]:
        """The longest steps over missing samples that are no holes [s]."""
        steps = (self._longest[:, 1] - self._longest[:, 0]) / self.period_ns
        return self._since_first(self._longest[(steps > _LOSSY_STEP) & (steps <= GAP_PERIODS)])

    def _since_first(self, pairs: Stamps) -> tuple[tuple[float, float], ...]:
        return tuple(((int(a) - self.first) * 1e-9, (int(b) - self.first) * 1e-9) for a, b in pairs)


def _pairs(stamps: Stamps) -> Stamps:
    """Each stamp with the next, shape (S - 1, 2)."""
    return np.column_stack([stamps[:-1], stamps[1:]])


def _longest(pairs: Stamps) -> Stamps:
    """Those of the longest steps, in order of time."""
    if len(pairs) <= _MOST_HOLES:
        return pairs
    kept = np.argpartition(pairs[:, 0] - pairs[:, 1], _MOST_HOLES)[:_MOST_HOLES]
    return pairs[np.sort(kept)]
