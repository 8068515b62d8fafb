"""Samples as they were taken: position, torque, and wanted position at each stamp of a log.

Messages of the three topics come in the order of the file; a sample is complete once the torque
and the wanted motion are known beyond its instant.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ident.recordings.log_summary import LogSummary
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Piece
from wamctl.arm.ros2.joint_series import Stamps

TorqueSource = Literal["commanded", "measured"]

ROUNDING = 1e-9
"""Smaller steps of a position [rad] are of arithmetic."""


@dataclass(frozen=True)
class Samples:
    """Consecutive samples at ascending stamps.

    Attributes:
        t: time since the recording's first stamp [s], shape (S,).
        q: position [rad], shape (S, n).
        tau: joint torque [N m], shape (S, n).
        reference: the wanted position [rad], shape (S, n), or None.
    """

    t: Array
    q: Array
    tau: Array
    reference: Array | None

    def part(self, places: slice | NDArray[np.bool_]) -> "Samples":
        """Some of the samples."""
        wanted = self.reference
        return Samples(
            self.t[places],
            self.q[places],
            self.tau[places],
            None if wanted is None else wanted[places],
        )

    def then(self, later: "Samples") -> "Samples":
        """These samples and later ones."""
        wanted = None
        if self.reference is not None and later.reference is not None:
            wanted = np.concatenate([self.reference, later.reference])
        return Samples(
            np.concatenate([self.t, later.t]),
            np.concatenate([self.q, later.q]),
            np.concatenate([self.tau, later.tau]),
            wanted,
        )

    def at(self, grid: Array) -> "Samples":
        """The samples at other instants between them [s], shape (G,)."""
        q, tau = (resampled(self.t, values, grid) for values in (self.q, self.tau))
        wanted = None if self.reference is None else resampled(self.t, self.reference, grid)
        return Samples(grid, q, tau, wanted)


def chosen_torque(found: LogSummary, torque: TorqueSource | None) -> TorqueSource:
    """Which torque to use: as asked for, else the commanded one where there is one.

    Raises:
        DataError: the log does not hold it.
    """
    if torque is None and not (found.commanded or found.measured):
        raise DataError(
            f"{found.name} holds no joint torque; identify the arm from commanded and measured"
            " positions (--method simulation, or method='simulation' in Python)."
        )
    torque = torque or ("commanded" if found.commanded else "measured")
    if not (found.commanded if torque == "commanded" else found.measured):
        raise DataError(f"{found.name} holds no {torque} torque; leave out --torque {torque}.")
    return torque


def read_samples(
    found: LogSummary, torque: TorqueSource, columns: Sequence[int]
) -> Iterator[Samples]:
    """The samples of a log, part by part; those that repeat a stamp are left out.

    Args:
        found: the log.
        torque: which one to use.
        columns: the log's joints to take, n of them.
    """
    waiting = _Waiting(found, torque, columns)
    for piece in found.pieces():
        waiting.add(piece)
        yield from waiting.taken(waiting.known_s)
    yield from waiting.taken(np.inf)


class Queue:
    """What is still needed of one topic: stamps of shape (S,), values of shape (S, width).

    Args:
        width: of the values.
        kind: of the stamps: numbers in [s], or whole ones in [ns].
    """

    def __init__(self, width: int, kind: type = float) -> None:
        self.t = np.empty(0, kind)
        self.values = np.empty((0, width))

    def add(self, t: NDArray, values: Array) -> None:
        """Later stamps and their values."""
        self.t = np.concatenate([self.t, t])
        self.values = np.concatenate([self.values, values])

    def drop(self, count: int) -> None:
        """Forgets the first ones."""
        self.t, self.values = self.t[count:], self.values[count:]

    def drop_before(self, instant: float) -> None:
        """Keeps what holds at an instant, and all that comes later."""
        self.drop(max(int(np.searchsorted(self.t, instant, side="right")) - 1, 0))


class _Waiting:
    """Messages that came, and samples that can be made of them."""

    def __init__(self, found: LogSummary, torque: TorqueSource, columns: Sequence[int]) -> None:
        n = len(columns)
        self._found, self._columns = found, columns
        self._last = -np.inf
        self._q = Queue(n)
        self._held = torque == "commanded"
        self._torque = Queue(n)
        self._reference = Queue(n) if found.reference else None

    def add(self, piece: Piece) -> None:
        states, commands, reference = piece.states, piece.commands, piece.reference
        if states is not None:
            self._add(self._q, states.stamp_ns, states.positions)
        source = commands if self._held else states
        if source is not None and source.effort is not None:
            self._add(self._torque, source.stamp_ns, source.effort)
        if reference is not None and self._reference is not None:
            self._add(self._reference, reference.stamp_ns, reference.q)

    def _add(self, queue: Queue, stamp_ns: Stamps, values: Array) -> None:
        queue.add((stamp_ns - self._found.first_ns) * 1e-9, values[:, self._columns])

    @property
    def known_s(self) -> float:
        """The instant before which all that makes up a sample has come [s]."""
        queues = [q for q in (self._torque, self._reference) if q is not None]
        return min((q.t[-1] - self._found.period_s if len(q.t) else -np.inf) for q in queues)

    def taken(self, until_s: float) -> Iterator[Samples]:
        """The samples before an instant, if there are any; they are kept no more."""
        count = int(np.searchsorted(self._q.t, until_s))
        if not count:
            return
        t, q = self._q.t[:count], self._q.values[:count]
        new = np.diff(t, prepend=self._last) > 0
        t, q = t[new], q[new]
        reference, period = self._reference, self._found.period_s
        if self._held:
            tau = held_mean(self._torque.t, self._torque.values, t, period)
        else:
            tau = self._torque.values[:count][new]
        wanted = None
        if reference is not None:
            columns = [np.interp(t, reference.t, c) for c in reference.values.T]
            wanted = np.column_stack(columns)
        self._q.drop(count)
        if not self._held:
            self._torque.drop(count)
        if len(t):
            self._last = t[-1]
            if self._held:
                self._torque.drop_before(t[-1] - period)
            if reference is not None:
                reference.drop_before(t[-1])
        yield Samples(t, q, tau, wanted)


def held_mean(t: Array, held: Array, at: Array, period: float) -> Array:
    """Mean over one period around each instant of a signal that is held from stamp to stamp.

    The drives hold a torque until the next one comes; the torque that belongs to a position is
    therefore half of the one before it and half of the one after it, where both have the same
    stamps.

    Args:
        t: stamps of the signal [s], shape (C,).
        held: its values, shape (C, n).
        at: instants [s], shape (S,).
        period: length of the mean [s].
    """
    steps = np.diff(t, append=t[-1] + period)[:, None]
    area = np.concatenate([np.zeros((1, held.shape[1])), np.cumsum(held * steps, axis=0)])
    edges = np.append(t, t[-1] + period)
    low = np.clip(at - period / 2, edges[0], edges[-1])
    high = np.clip(at + period / 2, edges[0], edges[-1])
    span = np.maximum(high - low, 1e-12)
    means = [
        (np.interp(high, edges, column) - np.interp(low, edges, column)) / span for column in area.T
    ]
    return np.column_stack(means)


def smallest_step(steps: Array, rounding: float = ROUNDING) -> float:
    """The step of an encoder, or of a torque that is recorded in steps; infinite without one.

    It is a quantile of the steps that are not zero: a single glitch may make the least.

    Args:
        steps: sizes of the moves from sample to sample, shape (S,).
        rounding: smaller ones are of arithmetic.
    """
    moved = steps[steps > rounding]
    return float(np.quantile(moved, 0.02)) if len(moved) else np.inf


def resampled(t: Array, values: Array, grid: Array) -> Array:
    """Values at other instants, by the cubic through the four nearest samples, shape (G, n).

    Args:
        t: ascending stamps [s], shape (S,).
        values: shape (S, n).
        grid: instants inside the stamps [s], shape (G,).
    """
    if len(t) < 4:
        return np.column_stack([np.interp(grid, t, column) for column in values.T])
    first = np.clip(np.searchsorted(t, grid, side="right") - 2, 0, len(t) - 4)
    nodes = [t[first + k] for k in range(4)]
    result = np.zeros((len(grid), values.shape[1]))
    for k in range(4):
        weight = np.ones(len(grid))
        for other in range(4):
            if other != k:
                weight *= (grid - nodes[other]) / (nodes[k] - nodes[other])
        result += weight[:, None] * values[first + k]
    return result


def filled(values: Array, bad: NDArray[np.bool_]) -> Array:
    """Values with the bad ones replaced by the cubic through their neighbours, shape (S, n).

    Args:
        values: at even instants, shape (S, n).
        bad: which of them, shape (S, n), or (S, 1) for all columns alike.
    """
    places, result = np.arange(float(len(values))), values
    for k, wrong in enumerate(np.broadcast_to(bad, values.shape).T):
        if wrong.any():
            result = values.copy() if result is values else result
            right = values[~wrong][:, [k]]
            result[wrong, k] = resampled(places[~wrong], right, places[wrong])[:, 0]
    return result
