"""Unbroken segments of a recording, smoothed and differentiated."""

from dataclasses import dataclass

import numpy as np

from ident.recordings.dataset import Segment
from ident.signals.arrays import Array
from ident.signals.zero_phase import Lowpass, extended, fast_length, spectrum

MOTION_HZ = 40.0
"""Cut-off for position, its derivatives and torque: it only tames the encoder's steps."""


DIRECTION_HZ = (20.0, 30.0, 45.0)
"""Cut-offs among which the velocity that friction's direction follows is chosen, joint by joint."""


_ORDER = 3


EDGE_S = 0.3
"""Left out at both ends of a segment, where filters have no past or future."""


SHORTEST_S = 8 * EDGE_S
"""Of a segment that is smoothed."""


HIGHEST_SHARE = 0.4
"""Of the sampling rate: the highest cut-off."""


@dataclass(frozen=True)
class SmoothedSegment:
    """Samples without a hole; their ends, where filters have no past or future, are left out.

    Attributes:
        log: number of the recording, from 0.
        rate_hz: of the samples.
        t: time since the recording's first sample [s], shape (S,).
        q, qd, qdd: smoothed motion, each of shape (S, n).
        tau: torque through the same filter [N m], shape (S, n).
        speeds: velocity by each cut-off of `DIRECTION_HZ` [rad/s], shape (C, S, n).
    """

    log: int
    rate_hz: float
    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    speeds: Array


def smoothed(
    segment: Segment,
    rate_hz: float,
    log: int,
    motion_hz: float = MOTION_HZ,
    edge_s: float = EDGE_S,
) -> SmoothedSegment | None:
    """A segment's samples but for its ends, as one segment; None if it is too short for that.

    Args:
        segment: the samples.
        rate_hz: of the samples.
        log: number of the recording.
        motion_hz: cut-off for position, its derivatives and torque.
        edge_s: what is left out at either end [s], an eighth of the segment at most.
    """
    edge = round(edge_s * rate_hz)
    samples = len(segment.q)
    if samples < 8 * edge:
        return None
    highest = HIGHEST_SHARE * rate_hz
    after = fast_length(samples + 4 * edge, 1) - samples - 2 * edge
    q = spectrum(extended(segment.q, 2 * edge, after), rate_hz)
    tau = spectrum(extended(segment.tau, 2 * edge, after), rate_hz)
    kept = slice(3 * edge, samples + edge)
    motion = Lowpass(min(motion_hz, highest), _ORDER, rate_hz)
    speeds = [
        q.signal(Lowpass(min(f, highest), _ORDER, rate_hz), derivative=1)[kept]
        for f in DIRECTION_HZ
    ]
    return SmoothedSegment(
        log,
        rate_hz,
        segment.start_s + np.arange(edge, samples - edge) / rate_hz,
        q.signal(motion)[kept],
        q.signal(motion, derivative=1)[kept],
        q.signal(motion, derivative=2)[kept],
        tau.signal(motion)[kept],
        np.stack(speeds),
    )
