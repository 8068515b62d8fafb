"""Noise that a motion makes by itself: what no model knows of dry friction at slow speed."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

_SLOW_RAD_S = 0.1
"""Below it dry friction depends on more than the sign of velocity (Armstrong-Helouvry et al. 1994,
section 2: presliding and the Stribeck effect)."""

_ELSEWHERE = 0.1
"""Noise at speed in units of that at rest."""


@dataclass(frozen=True)
class Noise:
    """The variance of each joint's torque, as far as the motion decides about it.

    Attributes:
        at_rest: variance that dry friction adds at rest, shape (n, 1) [(N m)^2].
        elsewhere: variance at any speed, shape (n, 1) [(N m)^2].
    """

    at_rest: Array
    elsewhere: Array

    @classmethod
    def of_friction(cls, coulomb_nm: Array) -> Self:
        """Noise in proportion to dry friction, shape (n,); the same everywhere without any."""
        coulomb = coulomb_nm[:, None]
        if not coulomb.any():
            return cls(np.zeros_like(coulomb), np.ones_like(coulomb))
        least = coulomb[coulomb > 0].min()
        return cls(coulomb**2, (_ELSEWHERE * np.maximum(coulomb, least)) ** 2)

    def variance(self, qd: Array) -> Array:
        """Of each torque, shape (n, S) [(N m)^2], at velocities of shape (S, n) [rad/s]."""
        return self.at_rest * _slowness(qd) + self.elsewhere

    def slope(self, qd: Array) -> Array:
        """Of `variance` by velocity, shape (n, S)."""
        return self.at_rest * _slowness(qd) * (-2.0 / _SLOW_RAD_S**2) * qd.T


def _slowness(qd: Array) -> Array:
    return np.exp(-((qd.T / _SLOW_RAD_S) ** 2))
