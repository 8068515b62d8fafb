"""The noise floor: how much the residual differs when the same motion is repeated."""

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.experiment import Experiment
from ident.gap.data.noise_regions import Region
from ident.gap.regression.design_matrix import Table, WindowedRows
from ident.gap.regression.residuals import Residual
from ident.model.attachments import attached_trajectory

Array = NDArray[np.floating]

_SAME_PLACE = 0.01  # rad: two rows count as repeats when no joint is further away
_LEAST_PAIRS = 20
_APART = 10.0  # times `_SAME_PLACE`: so far the motion must go before it can come again
_LEAST_SHARE = 0.1  # of a recording's rows must come again


def noise_floor(
    source: Experiment, rows: WindowedRows, table: Table, left: list[Residual]
) -> Array | None:
    """Rms noise per joint and region [N m], shape (n, regions), from one period to the next.

    What the model gets wrong in the same way each time cancels in the difference of two periods.
    None where no motion is repeated; not-a-number for a region without repeats, and for joints
    that are held.
    """
    first, second = pairs(source, rows, table)
    if len(first) < _LEAST_PAIRS:
        return None
    floor = np.full((len(left), len(Region)), np.nan)
    for j, r in enumerate(left):
        if len(r.values) == 0:
            continue
        for region in Region:
            here = (r.region[first] == region) & (r.region[second] == region)
            if here.sum() >= _LEAST_PAIRS:
                change = r.values[second[here]] - r.values[first[here]]
                floor[j, region] = np.sqrt(np.mean(change**2) / 2)
    return floor


def pairs(
    source: Experiment, rows: WindowedRows, table: Table
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of one period, and the same rows of the next.

    Where no trajectory travels inside a log, its period is the one after which the most rows find
    the arm in the same place.
    """
    hop_s = rows.windows.hop / rows.windows.rate_hz
    log = np.array([s.log for s in rows.segments])[table.segment]
    q = np.concatenate([rows.windows.mean(s.q) for s in rows.segments])
    first, second = [], []
    for number, (recording, data) in enumerate(
        zip(source.recordings, source.datasets, strict=True)
    ):
        here = np.flatnonzero(log == number)
        hops = np.round(table.t[here] / hop_s).astype(int)
        place = np.full(hops.max(initial=-1) + 1, -1)
        place[hops] = here
        file = attached_trajectory(recording, data.name)
        lag = _period(q, place) if file is None else 2 * np.pi / file.fundamental_rad_s / hop_s
        if lag is not None:
            one, two = _together(q, place, round(lag))
            first.append(one)
            second.append(two)
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *first]), np.concatenate([none, *second])


def _period(q: Array, place: NDArray[np.int64]) -> int | None:
    """Number of hops after which a recording's motion comes again, or None if it does not."""
    there = place[place >= 0]
    most, best, left = max(_LEAST_PAIRS, _LEAST_SHARE * len(there)), None, False
    for lag in range(1, len(place) - _LEAST_PAIRS):
        one, two = place[:-lag], place[lag:]
        both = (one >= 0) & (two >= 0)
        apart = np.abs(q[two[both]] - q[one[both]]).max(axis=1)
        left = left or float(np.median(apart)) > _APART * _SAME_PLACE
        close = int((apart < _SAME_PLACE).sum())
        if left and close > most:
            most, best = close, lag
    return best


def _together(
    q: Array, place: NDArray[np.int64], lag: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows that lie so many hops apart and find the arm in the same place."""
    one, two = place[:-lag], place[lag:]
    both = (one >= 0) & (two >= 0)
    one, two = one[both], two[both]
    same = np.abs(q[two] - q[one]).max(axis=1, initial=0.0) < _SAME_PLACE
    return one[same], two[same]
