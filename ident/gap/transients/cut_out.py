"""Recordings without the time in which something outside pushed the arm."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.gap.transients.detect import Transient
from ident.recordings.dataset import Dataset, Segment, in_memory


def cut_out(data: Dataset, log: int, transients: Sequence[Transient]) -> Dataset:
    """A recording, cut where transients act in it.

    Args:
        data: the recording.
        log: its number among those of the search, from 0.
        transients: of all recordings.
    """
    spans = [(b.start_s, b.end_s) for b in transients if b.log == log]
    if not spans:
        return data
    return in_memory(data, data.rate_hz, [x for s in data.segments for x in _parts(data, s, spans)])


def _parts(data: Dataset, whole: Segment, spans: Sequence[tuple[float, float]]) -> list[Segment]:
    t = whole.start_s + np.arange(len(whole.q)) / data.rate_hz
    inside = np.any([(t >= a) & (t < b) for a, b in spans], axis=0)
    edges = np.flatnonzero(np.diff(inside, prepend=True, append=True))
    first, end = whole.used or (0, len(t))
    return [
        replace(whole, used=(first, end)).part(int(a), int(b), data.rate_hz)
        for a, b in edges.reshape(-1, 2)
        if min(end, b) > max(first, a)
    ]
