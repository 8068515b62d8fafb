"""Recordings as uniform samples of position and torque, joints in the robot's order.

They are read from the log again whenever they are wanted, part by part, so that memory does not
grow with the log's length.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import groupby
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from ident.recordings.errors import JointMismatchError
from ident.recordings.log_summary import GAP_PERIODS, LogSummary, summarise_log
from ident.recordings.samples import Samples, TorqueSource, chosen_torque, read_samples
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording

_EARLY = 0.02
"""A span's last sample may come this part of a period early and still be counted."""

_EXACT = 1e-6
"""Stamps that stray less than this part of a period are on the grid."""

_SMALL_BYTES = 32e6
"""Recordings of so many bytes at most are held in memory: six minutes of seven joints at 500 Hz."""

_HELD = 0.05
"""A joint that spans less than this [rad or m] is held, and its place is not known any better."""


@dataclass(frozen=True)
class Span:
    """An unbroken stretch of uniform samples.

    Attributes:
        start_s: time of its first sample since the recording's first [s].
        length: number of samples.
        used: first and end of the samples that rows are wanted of; the others only feed the filter.
    """

    start_s: float
    length: int
    used: tuple[int, int]


@dataclass(frozen=True)
class Segment:
    """Consecutive uniform samples: a span, or a part of one.

    Attributes:
        start_s: time of its first sample since the recording's first [s].
        q: position [rad], shape (S, n).
        tau: joint torque [N m], shape (S, n).
        reference: the wanted position [rad], shape (S, n), or None.
        used: as of its span; None: all.
    """

    start_s: float
    q: Array
    tau: Array
    reference: Array | None = None
    used: tuple[int, int] | None = None

    def part(self, first: int, end: int, rate_hz: float) -> "Segment":
        """The samples from one up to another, as a segment of its own."""
        used = self.used and (max(self.used[0] - first, 0), min(self.used[1], end) - first)
        return Segment(
            self.start_s + first / rate_hz,
            self.q[first:end],
            self.tau[first:end],
            None if self.reference is None else self.reference[first:end],
            used,
        )


Parts = Iterator[tuple[int, Segment]]
"""Consecutive parts of all spans, each with the number of its span."""


@dataclass(frozen=True)
class Dataset:
    """One recording, ready for the filter.

    Attributes:
        name: the log's name.
        rate_hz: of the samples.
        spans: unbroken stretches, in order of time.
        torque: which torque it is.
        place: where each held joint is [rad or m], shape (n,); zero for moving ones.
        moving: which joints move, shape (n,).
        has_reference: whether the wanted position is known.
        facts: what was repaired or left out, one sentence each.
        source: the log that it was read from.
        read: reads all samples from the start.
        breaks: steps at which `segments` are cut: span, and the samples that each leads from and
            to.
    """

    name: str
    rate_hz: float
    spans: tuple[Span, ...]
    torque: TorqueSource
    place: Array
    moving: NDArray[np.bool_]
    has_reference: bool
    facts: tuple[str, ...]
    source: LogSummary
    read: Callable[[], Parts]
    breaks: tuple[tuple[int, int, int], ...] = ()

    @property
    def samples(self) -> int:
        """Number of used samples in all spans."""
        return sum(stop - start for start, stop in (s.used for s in self.spans))

    @property
    def span_s(self) -> tuple[float, float]:
        """Time of the first used sample, and of the end [s]."""
        used = [s for s in self.spans if s.used[1] > s.used[0]]
        return (
            used[0].start_s + used[0].used[0] / self.rate_hz,
            used[-1].start_s + used[-1].used[1] / self.rate_hz,
        )

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """The spans with used samples, cut at breaks only, for what cannot do with parts."""
        found = []
        for number, parts in groupby(self.read(), key=itemgetter(0)):
            span, together = self.spans[number], [part for _, part in parts]
            if span.used[1] > span.used[0]:
                used = None if span.used == (0, span.length) else span.used
                whole = replace(_together(together), start_s=span.start_s, used=used)
                pieces = self.unbroken(number) if self.breaks else []
                found += [whole.part(a, b, self.rate_hz) for a, b in pieces] or [whole]
        return tuple(found)

    def unbroken(self, span: int) -> list[tuple[int, int]]:
        """First sample and end of each part of a span between breaks."""
        broken = sorted(b[1:] for b in self.breaks if b[0] == span)
        starts = [0, *(last for _, last in broken)]
        ends = [*(first + 1 for first, _ in broken), self.spans[span].length]
        return [(a, b) for a, b in zip(starts, ends, strict=True) if b > a]

    def along_reference(self) -> "Dataset":
        """The same recording, had the arm moved as wanted."""

        def read() -> Parts:
            for number, part in self.read():
                if part.reference is not None:
                    yield number, replace(part, q=part.reference)

        return replace(self, read=read)

    def with_torque_times(self, factors: Array) -> "Dataset":
        """The same recording with its torque multiplied, joint by joint, shape (n,)."""
        return replace(self, read=partial(_torque_times, self, factors))


def _torque_times(data: Dataset, factors: Array) -> Parts:
    for number, part in data.read():
        yield number, replace(part, tau=part.tau * factors)


def dataset(
    recording: Recording,
    joint_names: Sequence[str],
    name: str,
    torque: TorqueSource | None = None,
    sliding: Sequence[bool] = (),
) -> Dataset:
    """A recording in memory as a dataset; errors are those of `summarise_log` and `dataset_of`."""
    return dataset_of(summarise_log(recording, name), joint_names, torque, sliding)


def dataset_of(
    found: LogSummary,
    joint_names: Sequence[str],
    torque: TorqueSource | None = None,
    sliding: Sequence[bool] = (),
) -> Dataset:
    """The samples of a log on a uniform grid.

    Args:
        found: the log.
        joint_names: the robot's joints, n of them.
        torque: which one to use; None takes the commanded one where there is one.
        sliding: which of the joints are prismatic, n of them; empty: none.

    Raises:
        DataError: joints or torque that cannot be used.
    """
    columns = _columns(found, joint_names)
    chosen = chosen_torque(found, torque)
    facts = []
    if found.repeated:
        facts.append(f"{found.repeated} samples repeat the stamp before them and were left out")
    if found.copies > 1:
        facts.append(
            f"the recorder wrote each reading {found.copies:.3g} times; the copies were left out,"
            f" and {1 / found.period_s:.4g} Hz are left"
        )
    if found.jitter_s:
        facts.append(
            f"its stamps jitter by {1e3 * found.jitter_s:.2g} ms (rms), and positions are smooth"
            f" over an even clock of {1 / found.period_s:.4g} Hz, which was taken instead"
        )
    if len(found.spans_s) > 1:
        holes = ", ".join(f"{start:.3f} s" for start, _ in found.spans_s[1:])
        facts.append(f"holes of more than {GAP_PERIODS} periods end at {holes}")
    low, high = found.low[columns], found.high[columns]
    moving = high - low >= _HELD
    if not moving.any():
        raise DataError(
            f"{found.name}: no joint moves by more than {_HELD} rad; nothing can be learned."
        )
    held = tuple(n for n, moves in zip(joint_names, moving, strict=True) if not moves)
    if held:
        facts.append(f"held: {', '.join(held)}")
    others = [n for n in found.joint_names if n not in joint_names]
    if others:
        facts.append(f"recorded, but no joints of the model: {', '.join(others)}")
    spans = tuple(_span(start, stop, found.period_s) for start, stop in found.spans_s)
    place = np.where(moving, 0.0, _place((low + high) / 2, sliding))
    return Dataset(
        name=found.name,
        rate_hz=round(1 / found.period_s, 6),
        spans=spans,
        torque=chosen,
        place=place,
        moving=moving,
        has_reference=found.reference,
        facts=tuple(facts),
        source=found,
        read=partial(_uniform, found, spans, chosen, columns, np.where(moving, np.nan, place)),
    )


def kept(data: Dataset) -> Dataset:
    """The same recording, held in memory if it is small, so that it is decoded once only."""
    numbers = data.samples * len(data.moving) * (3 if data.has_reference else 2)
    if 8 * numbers > _SMALL_BYTES:
        return data
    parts = [(k, list(run)) for k, run in groupby(data.read(), key=itemgetter(0))]
    whole = tuple((k, _together([part for _, part in run])) for k, run in parts)
    return replace(data, read=partial(iter, whole))


def _together(parts: Sequence[Segment]) -> Segment:
    """Consecutive parts of one span as one."""
    wanted = [p.reference for p in parts if p.reference is not None]
    return Segment(
        parts[0].start_s,
        np.concatenate([p.q for p in parts]),
        np.concatenate([p.tau for p in parts]),
        np.concatenate(wanted) if len(wanted) == len(parts) else None,
    )


def in_memory(data: Dataset, rate_hz: float, segments: Sequence[Segment]) -> Dataset:
    """The same recording with other samples."""
    spans = tuple(Span(s.start_s, len(s.q), s.used or (0, len(s.q))) for s in segments)
    read = partial(enumerate, tuple(segments))
    return replace(data, rate_hz=rate_hz, spans=spans, read=read, breaks=())


def _place(middle: Array, sliding: Sequence[bool]) -> Array:
    """Where held joints are: turning ones at the right angle beside their middle, if near."""
    right_angle = np.round(middle / (np.pi / 2)) * (np.pi / 2)
    turning = ~np.array(sliding or [False] * len(middle))
    return np.where(turning & (np.abs(middle - right_angle) < _HELD), right_angle, middle)


def _columns(found: LogSummary, joint_names: Sequence[str]) -> list[int]:
    present = found.joint_names
    missing = [j for j in joint_names if j not in present]
    if missing:
        raise JointMismatchError(found.name, missing, present)
    return [present.index(j) for j in joint_names]


def _span(start_s: float, stop_s: float, period: float) -> Span:
    length = int(np.floor((stop_s - start_s) / period + _EARLY)) + 1
    return Span(start_s, length, (0, length))


def _uniform(
    found: LogSummary,
    spans: Sequence[Span],
    torque: TorqueSource,
    columns: Sequence[int],
    place: Array,
) -> Parts:
    """All samples on the spans' grids; held joints at their place, which is NaN for the others."""
    starts = np.array([s.start_s for s in spans])
    number, grid = 0, _Grid(spans[0], found.period_s, place)
    for new in read_samples(found, torque, columns):
        span_of = np.searchsorted(starts, new.t, side="right") - 1
        for k in np.unique(span_of):
            if k != number:
                yield number, grid.rest()
                number, grid = int(k), _Grid(spans[k], found.period_s, place)
            part = grid.next(new.part(span_of == k))
            if part is not None:
                yield number, part
    yield number, grid.rest()


class _Grid:
    """The uniform samples of one span, made as the recorded ones come."""

    def __init__(self, span: Span, period: float, place: Array) -> None:
        self._span, self._period, self._place = span, period, place
        self._done = 0
        self._waiting: Samples | None = None

    def next(self, new: Samples) -> Segment | None:
        """The samples up to the last but one of the new ones, if there are any."""
        self._waiting = new if self._waiting is None else self._waiting.then(new)
        t = self._waiting.t
        if len(t) < 4:
            return None
        end = int(np.floor((t[-3] - self._span.start_s) / self._period)) + 1
        return self._until(self._waiting, end) if end > self._done else None

    def rest(self) -> Segment:
        """The samples that are left."""
        if self._waiting is None:
            raise ValueError("a span without samples")
        return self._until(self._waiting, self._span.length)

    def _until(self, waiting: Samples, end: int) -> Segment:
        period, t = self._period, waiting.t
        grid = self._span.start_s + period * np.arange(self._done, end)
        first = int(np.searchsorted(t, grid[0] - period / 2)) if len(grid) else 0
        found = waiting.part(slice(first, first + len(grid)))
        if len(found.t) < len(grid) or (np.abs(found.t - grid) > _EXACT * period).any():
            found = waiting.at(grid)
        following = self._span.start_s + period * end
        kept = max(int(np.searchsorted(t, following, side="right")) - 3, 0)
        self._done, self._waiting = end, waiting.part(slice(kept, None))
        q = np.where(np.isnan(self._place), found.q, self._place)
        start_s = self._span.start_s + period * (end - len(grid))
        return Segment(start_s, q, found.tau, found.reference)
