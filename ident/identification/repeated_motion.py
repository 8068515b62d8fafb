"""Stretches of recordings in which the arm moves alike: what the model gets wrong comes again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.regression.reduction import BLOCKS, Reduction
from ident.signals.arrays import Array

_GRID = 5040
"""Instants at which motions are compared; all numbers of periods tried divide it."""

_MOST_PERIODS = 12
_LEAST_GROUPS = 6
_ALIKE = 0.1  # of the speed's size: how far two motions may differ and still be one


@dataclass(frozen=True)
class RepeatedMotion:
    """Which stretches count as one.

    Attributes:
        groups: number of the group of each recording and stretch, shape (logs, BLOCKS).
        inflation: of the variance, where a motion repeats at other places than stretches end.
    """

    groups: NDArray[np.int64]
    inflation: float


def repeated_stretches(recordings: Sequence[Reduction]) -> RepeatedMotion:
    """Groups of stretches of all recordings, by the joints' speeds."""
    seen: list[Array] = []
    groups, inflation, first = np.zeros((len(recordings), BLOCKS), dtype=np.int64), 1.0, 0
    starts: list[int] = []
    for i, recording in enumerate(recordings):
        speed = _speeds(recording)
        like = next((k for k, other in enumerate(seen) if _alike(speed, other)), None)
        periods = _periods(speed)
        count = BLOCKS // periods if _splits(periods) else BLOCKS
        if not _splits(periods):
            inflation = max(inflation, float(periods))
        starts.append(first if like is None else starts[like])
        seen.append(speed)
        groups[i] = starts[i] + np.arange(BLOCKS) % count
        first = max(first, starts[i] + count)
    return RepeatedMotion(groups, inflation)


def _splits(periods: int) -> bool:
    return BLOCKS % periods == 0 and BLOCKS // periods >= _LEAST_GROUPS


def _speeds(recording: Reduction) -> Array:
    """Speeds of the joints at even instants, shape (G, n)."""
    start, end = recording.span_s
    t = start + (np.arange(_GRID) + 0.5) / _GRID * (end - start)
    excerpt = recording.excerpt
    return np.stack([np.interp(t, excerpt.t, column) for column in excerpt.speed.T], axis=1)


def _alike(one: Array, other: Array) -> bool:
    return bool(np.linalg.norm(one - other) < _ALIKE * np.linalg.norm(one))


def _periods(speed: Array) -> int:
    """How often the motion repeats within a recording; one if it does not."""
    inner = slice(_GRID // 50, -(_GRID // 50))  # rows at the ends are left out
    for periods in range(_MOST_PERIODS, 1, -1):
        if _GRID % periods == 0:
            lag = _GRID // periods
            if _alike(speed[inner][lag:], speed[inner][:-lag]):
                return periods
    return 1
