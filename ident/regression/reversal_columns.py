"""What the rows know of reversals: curves along which friction may turn round, and how near one is.

A low-pass spreads what the model gets wrong at a reversal over the time of its own memory, so that
rows are told apart by their distance in time from the nearest slow sample.
"""

import numpy as np
from numpy.typing import NDArray

from ident.effects.smoothed_segment import DIRECTION_HZ, MOTION_HZ
from ident.regression.filters import Processing
from ident.signals.arrays import Array
from ident.signals.zero_phase import Lowpass, Spectrum

_EDGES = (1.0, 2.0, 3.5, 5.5)
"""Ends of the regions about a reversal, in time constants of the rows' low-pass."""

REGIONS = len(_EDGES) + 1
"""Regions of rows by their distance from a reversal, the nearest first."""

_HIGHEST_SHARE = 0.4  # of the sampling rate
_ORDER = 3


def curve_columns(positions: Spectrum, process: Processing, moving: NDArray[np.bool_]) -> Array:
    """Each joint's smoothed signs of its own velocity at the full rate, shape (S, m, T).

    Args:
        positions: of a window, n joints.
        process: the filters.
        moving: which of the joints move, m of them, shape (n,).
    """
    if not process.curves:
        return np.zeros((positions.length, int(moving.sum()), 0))
    q = positions.signal(_lowpass(MOTION_HZ, positions.rate_hz))[:, moving]
    speeds = np.zeros((len(DIRECTION_HZ), *q.shape))
    for i in {curve.cutoff for curve in process.curves if curve.cutoff is not None}:
        lowpass = _lowpass(DIRECTION_HZ[i], positions.rate_hz)
        speeds[i] = positions.signal(lowpass, 1)[:, moving]
    columns = np.empty((*q.shape, len(process.curves)))
    for j in range(q.shape[1]):
        for i, curve in enumerate(process.curves):
            columns[:, j, i] = curve(q[:, j], speeds[:, :, j])
    return columns


def _lowpass(cutoff_hz: float, rate_hz: float) -> Lowpass:
    return Lowpass(min(cutoff_hz, _HIGHEST_SHARE * rate_hz), _ORDER, rate_hz)


def regions_of(speed: Array, rate_hz: float, process: Processing) -> NDArray[np.int64]:
    """Region of each sample and joint, shape (S, m), zero next to a reversal.

    Args:
        speed: of the m moving joints [rad/s], shape (S, m).
        rate_hz: of the samples.
        process: the filters.
    """
    if not process.curves or process.columns is None:
        return np.zeros(speed.shape, dtype=np.int64)
    slow = np.abs(speed) < process.threshold_rad_s
    slow[:-1] |= speed[:-1] * speed[1:] <= 0.0
    distance = np.stack([_to_nearest(column) for column in slow.T], axis=1) / rate_hz
    return np.searchsorted(np.array(_EDGES) * process.columns.time_constant_s, distance)


def _to_nearest(marked: NDArray[np.bool_]) -> Array:
    """Number of samples to the nearest marked one, shape (S,); infinite where none is."""
    places = np.flatnonzero(marked)
    if len(places) == 0:
        return np.full(len(marked), np.inf)
    here = np.arange(len(marked))
    after = np.searchsorted(places, here)
    right = np.abs(places[np.minimum(after, len(places) - 1)] - here)
    left = np.abs(places[np.maximum(after - 1, 0)] - here)
    return np.minimum(left, right).astype(float)
