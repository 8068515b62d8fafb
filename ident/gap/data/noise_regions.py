"""Noise regions: rows at reversals, while sliding, and at reversals of shared motors.

Each joint and region has a noise variance of its own in the weighted fit.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.windows import Windows
from ident.signals.arrays import Array


class Region(IntEnum):
    """Noise region of a row of one joint."""

    REVERSAL = 0
    """The joint stands still or reverses inside the window."""

    SLIDING = 1
    """The joint moves, and so do the motors that it shares with other joints."""

    MOTOR_REVERSAL = 2
    """The joint moves, and a motor that it shares with another joint reverses."""


def regions(
    speed: Array, slow: Array, motor_from_joint: Array | None, windows: Windows
) -> NDArray[np.int64]:
    """The region of each row, shape (R, n).

    Args:
        speed: joint velocity [rad/s], shape (S, n).
        slow: speed below which each joint counts as reversing [rad/s], shape (n,).
        motor_from_joint: motor angles from joint angles, shape (n, n), or None if unknown.
        windows: the averaging windows of the rows.
    """
    found = np.full((len(speed) // windows.hop - 1, speed.shape[1]), int(Region.SLIDING))
    if motor_from_joint is not None:
        for row in motor_from_joint:
            shared = np.flatnonzero(row)
            if len(shared) > 1:
                unit = row / np.abs(row).max()
                turning = windows.least(np.abs(speed @ unit)) < slow[shared].max()
                found[np.ix_(turning, shared)] = int(Region.MOTOR_REVERSAL)
    found[windows.least(np.abs(speed)) < slow] = int(Region.REVERSAL)
    return found
