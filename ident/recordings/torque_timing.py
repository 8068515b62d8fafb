"""Torque that acts later, or earlier, than its stamps say."""

from dataclasses import replace

import numpy as np

from ident.recordings.dataset import Dataset, Segment, in_memory
from ident.signals.zero_phase import delayed, extended

_EDGE_S = 0.5
"""By which a stretch is continued at both ends, beside the delay itself."""


def with_torque_later(data: Dataset, seconds: float) -> Dataset:
    """The same recording with torque that acts so much later than it was stamped [s].

    The samples are held in memory. What lies outside the recording is continued from its ends.
    """
    return in_memory(data, data.rate_hz, [_later(s, data.rate_hz, seconds) for s in data.segments])


def _later(segment: Segment, rate_hz: float, seconds: float) -> Segment:
    edge = min(int(np.ceil((abs(seconds) + _EDGE_S) * rate_hz)), len(segment.tau) - 1)
    moved = delayed(extended(segment.tau, edge, edge), rate_hz, seconds)
    return replace(segment, tau=moved[edge : edge + len(segment.tau)])
