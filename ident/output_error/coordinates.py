"""Settings as a fit moves them, and back."""

import numpy as np
from numpy.typing import NDArray

from ident.output_error.parameters import PER_STIFFNESS, QUANTITIES, ROW
from ident.signals.arrays import Array

_STIFFNESS = ROW["stiffness"]


def coordinates(settings: Array) -> Array:
    """Settings as a fit moves them: logarithms, or in units of their scale."""
    rows = [
        np.log(row) if q.scale == 0.0 else row / q.scale
        for q, row in zip(QUANTITIES, settings / _units(settings[_STIFFNESS]), strict=True)
    ]
    return np.array(rows)


def settings_at(place: Array) -> Array:
    """The settings at coordinates, inside their bounds."""
    rows = [
        np.exp(np.clip(row, -60, 60)) if q.scale == 0.0 else row * q.scale
        for q, row in zip(QUANTITIES, place, strict=True)
    ]
    low, high = bounds()
    stiffness = np.clip(rows[_STIFFNESS], low[_STIFFNESS], high[_STIFFNESS])
    return np.clip(rows * _units(stiffness), low, high)


def turned(settings: Array, rows: NDArray[np.int64]) -> Array:
    """Change of a joint's settings per coordinate, shape (p, p).

    Args:
        settings: of the joint, shape (quantities,).
        rows: which of them, shape (p,).
    """
    units = _units(settings[_STIFFNESS : _STIFFNESS + 1])[rows, 0]
    scales = np.array([QUANTITIES[r].scale for r in rows])
    made = np.diag(np.where(scales == 0.0, settings[rows], scales * units))
    with_stiffness = [QUANTITIES[r].name in PER_STIFFNESS for r in rows]
    made[np.ix_(with_stiffness, rows == _STIFFNESS)] = settings[rows][with_stiffness, None]
    return made


def _units(stiffness: Array) -> Array:
    """What each quantity is measured in, the stiffness or nothing, shape (quantities, n)."""
    part = stiffness / QUANTITIES[_STIFFNESS].first
    return np.array([part if q.name in PER_STIFFNESS else np.ones_like(part) for q in QUANTITIES])


def bounds() -> tuple[Array, Array]:
    """The least and the greatest value of each quantity, shape (quantities, 1) each."""
    return np.array([[q.low] for q in QUANTITIES]), np.array([[q.high] for q in QUANTITIES])
