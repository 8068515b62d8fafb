"""Where stamps and motion disagree, a recording is two recordings.

A reading that was lost, written twice or stamped late moves all joints by the same time at once. No
torque does that: it changes velocities, and positions go on from where they were. Filtered, such a
step is a blow at every joint. So is a controller that pauses for some milliseconds, which jerks the
arm more than the samples tell. A step is broken if its mean velocity lies outside of those on its
two sides, by the same time at all joints, and far beyond what the recording's other steps do. A
joint that turns round there tells no time, since its velocity may have been any. Broken steps are
cut out. Where samples are lost so often that no step is unusual, that is a fault of the data, which
makes every effect doubtful.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.checks.recorder_faults.lost_samples import repeated_and_skipped
from ident.checks.remark import Grade, Remark
from ident.checks.settings import DEFAULT
from ident.effects.smoothed_segment import EDGE_S, HIGHEST_SHARE, MOTION_HZ, SHORTEST_S
from ident.gap.settings import BrokenTime
from ident.recordings.dataset import Dataset, Segment
from ident.recordings.samples import ROUNDING

_BESIDE = 4  # steps on each side of one, whose median is the velocity there: one may be wrong
_PERIOD = 0.99  # of the fastest motion, from which what was not recorded is cut out
_ON_GRID = 1e-3  # periods by which a stamp may stray


@dataclass(frozen=True)
class Break:
    """A step that is no evidence of what the arm did.

    Attributes:
        span: its number in the recording.
        first, last: the samples that it leads from and to.
        off_s: by how much the motion is ahead of the stamps [s]; zero where they agree, and only
            too much was not recorded.
    """

    span: int
    first: int
    last: int
    off_s: float = 0.0


@dataclass(frozen=True)
class Fault:
    """Samples that are lost although the stamps are even.

    Attributes:
        text: the fault in a sentence.
        count: number of losses.
    """

    text: str
    count: int


def data_faults(datasets: Sequence[Dataset]) -> list[Fault]:
    """Lost samples of some recordings that are left once all that can be mended or cut out is."""
    counts = [(d.name, repeated_and_skipped(d.segments, d, DEFAULT)[1]) for d in datasets]
    return [
        Fault(
            f"{name}: {count} times a sample is lost, on all moving joints at once, although the"
            " stamps are even.",
            count,
        )
        for name, count in counts
        if count
    ]


def unbroken(data: Dataset, bounds: BrokenTime) -> tuple[Dataset, list[Remark]]:
    """The recording, cut where it is broken, and what is said of it.

    Steps that were not recorded, as long as a period of the fastest motion, are cut out, too: the
    curve through them is no evidence. Where too little would be left, the recording stays whole
    at the shortest of them.
    """
    numbers = [k for k, s in enumerate(data.spans) if s.used[1]]
    pairs = zip(numbers, data.segments, strict=True)
    found = [b for k, segment in pairs for b in _breaks(data, k, segment, bounds)]
    found.sort(key=lambda b: (b.off_s == 0.0, b.first - b.last))
    cut = [replace(data, breaks=_joined(data, found[:count])) for count in range(len(found) + 1)]
    least = bounds.least_kept * _smoothed_s(data)
    count = bisect_left(cut, True, lo=1, key=lambda d: _smoothed_s(d) < least) - 1
    return cut[count], _remarks(data, found, count)


def _joined(data: Dataset, breaks: Sequence[Break]) -> tuple[tuple[int, int, int], ...]:
    """Breaks as spans and samples, with what lies between two, too short to be smoothed."""
    least = SHORTEST_S * data.rate_hz
    joined: list[tuple[int, int, int]] = []
    for b in sorted(breaks, key=lambda b: (b.span, b.first)):
        ahead = joined.pop() if joined and joined[-1][0] == b.span else (b.span, -1, 0)
        alone = b.first - ahead[2] >= least
        joined += [ahead, (b.span, b.first, b.last)] if alone else [(b.span, ahead[1], b.last)]
    ends = {k: span.length for k, span in enumerate(data.spans)}
    return tuple(
        (k, a, b if ends[k] - b >= least else ends[k]) for k, a, b in joined if (a, b) != (-1, 0)
    )


def _smoothed_s(data: Dataset) -> float:
    """How much of a recording is left once its segments are smoothed [s]."""
    parts = [p for k, s in enumerate(data.spans) if s.used[1] for p in data.unbroken(k)]
    lengths = [(end - first) / data.rate_hz for first, end in parts]
    return sum(seconds - 2 * EDGE_S for seconds in lengths if seconds >= SHORTEST_S)


def _remarks(data: Dataset, found: Sequence[Break], count: int) -> list[Remark]:
    """Steps by which stamps and motion are apart; doubtful where some could not be cut out."""
    apart = [b for b in found if b.off_s]
    if not apart:
        return []
    worst = max(apart, key=lambda b: abs(b.off_s))
    at_s = data.spans[worst.span].start_s + worst.first / data.rate_hz
    text = (
        f"{data.name}: at {at_s:.3f} s all joints are {abs(worst.off_s) * 1e3:.2g} ms"
        f" {'ahead of' if worst.off_s > 0 else 'behind'} their stamps at once"
        f"{f' ({len(apart)} such steps)' if len(apart) > 1 else ''}, which no torque does: readings"
        " were lost, repeated or stamped late, or the controller paused."
    )
    if len(apart) <= count:
        text += " The search takes what lies before and after for two recordings."
        return [Remark("broken_time", (), text, Grade.TRUSTWORTHY)]
    advice = "Check the recorder and the bus for overload, and record again if you can."
    return [Remark("broken_time", (), text, Grade.DOUBTFUL, advice)]


def _breaks(data: Dataset, number: int, segment: Segment, bounds: BrokenTime) -> list[Break]:
    """The broken steps of a segment, in order of time."""
    q = segment.q[:, data.moving]
    nodes = _nodes(data, segment)
    if len(nodes) < 3 * _BESIDE:
        return []
    steps = np.diff(nodes)
    velocity = np.diff(q[nodes], axis=0) / steps[:, None]
    around = np.lib.stride_tricks.sliding_window_view(velocity, _BESIDE, axis=0)
    before = np.median(around[: -_BESIDE - 1], axis=-1)
    after = np.median(around[_BESIDE + 1 :], axis=-1)
    here, steps = velocity[_BESIDE:-_BESIDE], steps[_BESIDE:-_BESIDE]
    middle, half = (before + after) / 2, np.abs(before - after) / 2
    beyond = np.maximum(np.abs(here - middle) - half, 0.0) * steps[:, None]
    usual = np.maximum(np.quantile(beyond, bounds.usual_share, axis=0), ROUNDING)
    sure = np.sign(middle) * np.maximum(np.abs(middle) - half, 0.0) / usual
    speed = np.maximum((sure * middle / usual).sum(axis=1), 1e-300)
    off = (sure * (here - middle) / usual).sum(axis=1) / speed
    left = np.abs(here - middle * (1 + off[:, None])) - half * (1 + np.abs(off[:, None]))
    same = np.sum((np.maximum(left, 0.0) / usual) ** 2, axis=1) < bounds.apart**2 * off**2 * speed
    squares = (beyond / usual) ** 2
    far = squares.sum(axis=1) > bounds.far**2
    by_others = squares.sum(axis=1) - squares.max(axis=1) > bounds.far**2
    least = np.where(by_others, bounds.least_pause, bounds.least_steps)
    broken = far & same & (np.abs(off) * steps > least)
    period = data.rate_hz / min(MOTION_HZ, HIGHEST_SHARE * data.rate_hz)
    found = np.flatnonzero(broken | (steps > _PERIOD * period))
    return [
        Break(number, int(a), int(a + n), float(o * n / data.rate_hz))
        for a, n, o in zip(nodes[_BESIDE + found], steps[found], (off * broken)[found], strict=True)
    ]


def _nodes(data: Dataset, segment: Segment) -> NDArray[np.intp]:
    """The samples but for those that bridge a longer step between stamps."""
    recorded = np.ones(len(segment.q), dtype=bool)
    for start, stop in data.source.bridged_s:
        a, b = ((t - segment.start_s) * data.rate_hz for t in (start, stop))
        if b > 0 and a < len(recorded):
            inside = int(np.floor(a + _ON_GRID)) + 1, int(np.ceil(b - _ON_GRID))
            recorded[max(inside[0], 1) : inside[1]] = False
    return np.flatnonzero(recorded)
