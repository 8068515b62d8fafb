"""Logs whose stamps jitter although their samples were taken evenly.

A driver reads its joints by a clock of its own, and the stamp is written when the message is: some
time later, and not always the same. Which of the two clocks is right the joints tell, since nothing
that has mass jitters: positions are smooth over the instants at which they were measured, and rough
over any others.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.signals.arrays import Array
from wamctl.arm.recording import Piece
from wamctl.arm.ros2.joint_series import Stamps

_SMOOTHER = 0.7
"""Of the roughness over the stamps: what is rough over even instants, where these are right."""

_MOST_SAMPLES = 100_000
"""So many samples tell how rough a motion is."""

_WANDER_PERIODS = 0.5
"""By which stamps may leave an even clock for as long as a block: more is no jitter."""

_BLOCK = 100
"""Samples over whose mean jitter is none."""


@dataclass(frozen=True)
class EvenClock:
    """Instants that are as far apart as each other.

    Attributes:
        start_ns: near the first one [ns]; whole, since one of our time has no room for more.
        offset_ns: of the first one from that [ns].
        period_ns: from one to the next [ns].
        jitter_s: by how much the stamps are off, rms [s].
    """

    start_ns: int
    offset_ns: float
    period_ns: float
    jitter_s: float

    def stamps(self, first: int, count: int) -> Stamps:
        """Instants of some samples in a row, shape (count,).

        Args:
            first: number of the first one.
            count: how many.
        """
        since = self.offset_ns + self.period_ns * np.arange(first, first + count)
        return self.start_ns + np.round(since).astype(np.int64)


def even_clock(
    pieces: Callable[[], Iterator[Piece]], moving: NDArray[np.bool_]
) -> EvenClock | None:
    """The clock that a log's samples were taken by, if its stamps only jitter about one.

    None where commands come at instants of their own, or positions are no smoother over it.

    Args:
        pieces: reads the log, of which no sample is missing.
        moving: which of its joints move, shape (N,).
    """
    stamps, positions, kept = [], [], 0
    for piece in pieces():
        if piece.commands is not None:
            return None
        if piece.states is None:
            continue
        stamps.append(piece.states.stamp_ns)
        if kept < _MOST_SAMPLES:
            positions.append(piece.states.positions)
            kept += len(stamps[-1])
    stamp_ns = np.concatenate(stamps)
    count = len(stamp_ns)
    if count < 2 * _BLOCK:
        return None
    since = (stamp_ns - stamp_ns[0]).astype(float)
    number = np.arange(count) - (count - 1) / 2
    period = float(number @ since / (number @ number))
    off = since - since.mean() - period * number
    blocks = off[: count // _BLOCK * _BLOCK].reshape(-1, _BLOCK).mean(axis=1)
    if np.abs(blocks).max() > _WANDER_PERIODS * period:
        return None
    q = np.concatenate(positions)[:, moving]
    even = _roughness(np.arange(len(q)) * period, q)
    stamped = _roughness(since[: len(q)], q)
    if not float(np.median(even / stamped)) < _SMOOTHER:
        return None
    jitter_s = float(np.sqrt(np.mean(off**2))) * 1e-9
    return EvenClock(int(stamp_ns[0]), float(since.mean()) + period * number[0], period, jitter_s)


def evenly_stamped(pieces: Callable[[], Iterator[Piece]], clock: EvenClock) -> Iterator[Piece]:
    """A log's pieces with the instants of an even clock."""
    done = 0
    for piece in pieces():
        if piece.states is None:
            yield piece
            continue
        count = len(piece.states.stamp_ns)
        yield replace(piece, states=replace(piece.states, stamp_ns=clock.stamps(done, count)))
        done += count


def _roughness(t: Array, q: Array) -> Array:
    """Mean size of third divided differences, shape (m,): of what a motion has least.

    Args:
        t: instants, shape (S,).
        q: positions, shape (S, m).
    """
    rough = q
    for order in (1, 2, 3):
        rough = np.diff(rough, axis=0) / (t[order:] - t[:-order])[:, None]
    return np.maximum(np.abs(rough).mean(axis=0), np.finfo(float).tiny)
