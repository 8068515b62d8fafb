"""Zero poses that are right angles from the URDF's, as gravity shows them.

A fit that begins a right angle from the truth does not come back: it makes a stiff servo of a load
that it looks for in the wrong poses. The first guess's regression needs no beginning.
"""

import numpy as np
from numpy.typing import NDArray

from ident.output_error.first_guess import unexplained
from ident.output_error.parameters import ROW
from ident.output_error.setup import Setup
from ident.signals.arrays import Array

_TURNS = (np.pi / 2, -np.pi / 2, np.pi)
_FEWER = 0.7
"""Of what is left at the URDF's zero; 0.78 is the least that right zeros of a hobby arm reach."""


def turned_zeros(setup: Setup, settings: Array, moving: NDArray[np.bool_]) -> Array:
    """Turns of joints with which gravity explains far more, zero elsewhere [rad], shape (n,).

    Args:
        setup: arm and recordings.
        settings: of the arm as it was found, shape (quantities, n).
        moving: joints that move, shape (n,).
    """
    turned = np.zeros(len(moving))
    for j in np.flatnonzero(moving).tolist():
        delay, zero = float(settings[ROW["delay"], j]), settings[ROW["zero"]]
        now, weighed = unexplained(setup, j, delay, zero)
        if weighed:
            continue
        least = min(_FEWER * now, now - setup.resolution[j])
        for turn in _TURNS:
            tried = zero.copy()
            tried[j] += turn
            left, shows = unexplained(setup, j, delay, tried)
            if shows and left < least:
                turned[j], least = turn, left
    return turned
