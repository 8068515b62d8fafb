"""Unbroken segments of the recordings, smoothed, differentiated, and divided into folds."""

import itertools
from collections.abc import Sequence

import numpy as np

from ident.effects.smoothed_segment import SmoothedSegment, smoothed
from ident.gap.data.windows import Windows
from ident.recordings.dataset import Dataset
from wamctl.arm.errors import DataError

FOLDS = 3

SEARCHED = (0, 1)
"""Folds on which effects are searched and fitted."""

HELD_OUT = 2
"""The fold that no search sees."""

EXCLUDED = -1
"""Fold number of rows that no fit uses: those inside transients."""

# enough blocks that each fold sees all of the motion; long logs need no more
_BLOCKS_OF_SHORT_LOG, _BLOCKS_OF_LONG_LOG, _SHORT_S = 18, 9, 30.0
_MIN_HOPS_PER_BLOCK = 6


def segments(datasets: Sequence[Dataset], windows: Windows) -> list[SmoothedSegment]:
    """All segments of some recordings, cut into blocks of time, dealt out to the folds in turn.

    A recording is no fold by itself: without the only one in which all joints move, the others may
    not tell the arm's parameters apart.

    Raises:
        DataError: no unbroken stretch is long enough to be smoothed.
    """
    found = []
    for log, data in enumerate(datasets):
        for segment in data.segments:
            whole = smoothed(segment, data.rate_hz, log)
            found += [] if whole is None else _blocks(whole, windows)
    if not found:
        raise DataError(
            "No unbroken stretch of these recordings is long enough for a search: record several"
            " seconds without holes."
        )
    return found


def _blocks(whole: SmoothedSegment, windows: Windows) -> list[SmoothedSegment]:
    duration = len(whole.t) / whole.rate_hz
    most = _BLOCKS_OF_SHORT_LOG if duration < _SHORT_S else _BLOCKS_OF_LONG_LOG
    hops = len(whole.t) // windows.hop
    count = min(most, max(FOLDS, hops // _MIN_HOPS_PER_BLOCK))
    edges = np.linspace(0, hops, count + 1).astype(int) * windows.hop
    return [
        whole.part(slice(int(a), int(b)), i % FOLDS)
        for i, (a, b) in enumerate(itertools.pairwise(edges))
    ]
