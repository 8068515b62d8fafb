"""Shapes of Coulomb friction around a reversal, among which the data choose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.stretch import DIRECTION_HZ

Array = NDArray[np.floating]

_WIDTHS = (0.001, 0.002, 0.003, 0.0045, 0.0065, 0.009, 0.013, 0.018, 0.026, 0.035)


def _ramp(u: Array) -> Array:
    return np.clip(u, -1.0, 1.0)


def _algebraic(u: Array) -> Array:
    return u / np.sqrt(1.0 + u * u)


FORMS = {"ramp": _ramp, "tanh": np.tanh, "algebraic": _algebraic}
"""How the sign of the velocity is smoothed, as functions of velocity by width."""


@dataclass(frozen=True)
class Turning:
    """A smoothed sign of the velocity.

    Attributes:
        cutoff: which of the velocities of `DIRECTION_HZ` it takes.
        form: name in `FORMS`.
        width: [rad/s].
    """

    cutoff: int
    form: str
    width: float

    def __call__(self, speed: Array) -> Array:
        """The smoothed sign of a speed [rad/s]."""
        return FORMS[self.form](speed / self.width)


TURNINGS = tuple(
    Turning(c, form, width) for c in range(len(DIRECTION_HZ)) for form in FORMS for width in _WIDTHS
)
"""All candidates."""

USUAL = TURNINGS.index(Turning(1, "tanh", _WIDTHS[3]))
"""Where the choice begins."""
