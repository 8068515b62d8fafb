"""Blocks of time: unbroken stretches of the recordings, smoothed and divided into folds.

What an effect does may depend on the motion long before, so its columns are formed along whole
stretches; only the windows that reach from one block into the next are left out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.effects.smoothed_segment import SmoothedSegment, smoothed
from ident.gap.data.windows import Windows
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

T = TypeVar("T", bound=np.generic)

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


@dataclass(frozen=True)
class Blocks:
    """Unbroken segments, and the windows of them that lie in one block of time each: the rows.

    Attributes:
        segments: the samples.
        windows: the averaging windows.
        kept: windows of each segment that are rows, each of shape (R_i,).
        number: of the block of each row, shape (R,).
        fold: of each row, shape (R,): 0 and 1 are searched, 2 is held out.
        log: number of the recording of each row, shape (R,).
    """

    segments: tuple[SmoothedSegment, ...]
    windows: Windows
    kept: tuple[NDArray[np.int64], ...]
    number: NDArray[np.int64]
    fold: NDArray[np.int64]
    log: NDArray[np.int64]

    def rows(self, of_windows: Callable[[SmoothedSegment], NDArray[T]]) -> NDArray[T]:
        """What is known of all windows of each segment, in the order of the rows, shape (R, ...).

        Args:
            of_windows: of a segment, shape (windows, ...).
        """
        pairs = zip(self.segments, self.kept, strict=True)
        return np.concatenate([of_windows(s)[kept] for s, kept in pairs])

    def means(self, samples: Callable[[SmoothedSegment], Array]) -> Array:
        """Weighted means of samples, shape (R, ...).

        Args:
            samples: of a segment, shape (S, ...).
        """
        return self.rows(lambda s: self.windows.mean(samples(s)))


def blocks_of(datasets: Sequence[Dataset], windows: Windows) -> Blocks:
    """All segments of some recordings, cut into blocks of time, dealt out to the folds in turn.

    A recording is no fold by itself: without the only one in which all joints move, the others may
    not tell the arm's parameters apart.

    Raises:
        DataError: no unbroken stretch is long enough to be smoothed.
    """
    found = [
        (whole, *_divided(whole, windows))
        for log, data in enumerate(datasets)
        for segment in data.segments
        if (whole := smoothed(segment, data.rate_hz, log)) is not None
    ]
    if not found:
        raise DataError(
            "No unbroken stretch of these recordings is long enough for a search: record several"
            " seconds without holes."
        )
    segments, kept, block = zip(*found, strict=True)
    before = np.cumsum([0, *(b.max(initial=-1) + 1 for b in block[:-1])])
    return Blocks(
        segments,
        windows,
        kept,
        np.concatenate([b + first for b, first in zip(block, before, strict=True)]),
        np.concatenate([b % FOLDS for b in block]),
        np.repeat([s.log for s in segments], [len(k) for k in kept]),
    )


def _divided(
    whole: SmoothedSegment, windows: Windows
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The windows of a segment that lie in one block of it, and the number of that block."""
    duration = len(whole.t) / whole.rate_hz
    most = _BLOCKS_OF_SHORT_LOG if duration < _SHORT_S else _BLOCKS_OF_LONG_LOG
    hops = len(whole.t) // windows.hop
    count = min(most, max(FOLDS, hops // _MIN_HOPS_PER_BLOCK))
    edges = np.linspace(0, hops, count + 1).astype(int)
    block = np.searchsorted(edges, np.arange(hops), side="right") - 1  # of each hop
    kept = np.flatnonzero(block[1:] == block[:-1])
    return kept, block[kept]
