"""Unbroken segments of the recordings, smoothed and differentiated."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.effects.smoothed_segment import SmoothedSegment, smoothed
from ident.gap.data.windows import Windows
from ident.recordings.dataset import Dataset
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]


_FOLDS = 3
_BLOCKS_OF_SHORT_LOG, _BLOCKS_OF_LONG_LOG, _SHORT_S = 18, 9, 30.0


def segments(datasets: Sequence[Dataset], windows: Windows) -> list[SmoothedSegment]:
    """All segments of some recordings, divided into folds.

    Three recordings or more are divided as whole recordings; fewer in blocks, every third of which
    goes to the same fold.

    Raises:
        DataError: no unbroken stretch is long enough to be smoothed.
    """
    found = []
    for log, data in enumerate(datasets):
        for segment in data.segments:
            whole = smoothed(segment, data.rate_hz, log)
            if whole is None:
                continue
            if len(datasets) >= _FOLDS:
                found.append(whole.part(slice(None), log % _FOLDS))
            else:
                found += _blocks(whole, windows)
    if not found:
        raise DataError(
            "No unbroken stretch of these recordings is long enough for a search: record several"
            " seconds without holes."
        )
    return found


def _blocks(whole: SmoothedSegment, windows: Windows) -> list[SmoothedSegment]:
    duration = len(whole.t) / whole.rate_hz
    count = _BLOCKS_OF_SHORT_LOG if duration < _SHORT_S else _BLOCKS_OF_LONG_LOG
    hops = len(whole.t) // windows.hop
    edges = np.linspace(0, hops, min(count, max(3, hops // 6)) + 1).astype(int) * windows.hop
    return [
        whole.part(slice(int(a), int(b)), i % _FOLDS)
        for i, (a, b) in enumerate(itertools.pairwise(edges))
    ]
