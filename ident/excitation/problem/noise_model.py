"""Noise that a motion makes by itself: what a model does not know of joints that turn back."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ident.dynamics.regressor import Motion
from ident.signals.arrays import Array

_SLOW_RAD_S = 0.1
"""Below it dry friction depends on more than the sign of velocity (Armstrong-Helouvry et al. 1994,
section 2: presliding and the Stribeck effect)."""

_BRISK_RAD_S2 = 1.0
"""Acceleration at which a joint that turns back makes noise as large as its dry friction. The
slower it turns, the longer that lasts and the less it is: each reversal leaves the same."""

_ELSEWHERE = 0.1
"""Noise at speed in units of dry friction."""

_NONE_RAD_S2 = 0.01
"""Smooths the size of small accelerations."""


@dataclass(frozen=True)
class Noise:
    """The variance of each joint's torque, as far as the motion decides about it.

    Attributes:
        turning: variance of a joint that turns back at 1 rad/s^2, shape (n, 1) [(N m)^2].
        elsewhere: variance at any speed, shape (n, 1) [(N m)^2].
    """

    turning: Array
    elsewhere: Array

    @classmethod
    def of_friction(cls, coulomb_nm: Array) -> Self:
        """Noise in proportion to dry friction, shape (n,); the same everywhere without any."""
        coulomb = coulomb_nm[:, None]
        if not coulomb.any():
            return cls(np.zeros_like(coulomb), np.ones_like(coulomb))
        least = coulomb[coulomb > 0].min()
        return cls(coulomb**2, (_ELSEWHERE * np.maximum(coulomb, least)) ** 2)

    def variance(self, motion: Motion) -> Array:
        """Of each torque, shape (n, S) [(N m)^2], along a motion of S samples."""
        return self.turning * _slowness(motion) * _briskness(motion) + self.elsewhere

    def slopes(self, motion: Motion) -> tuple[Array, Array]:
        """Of `variance` by velocity and by acceleration, each of shape (n, S)."""
        slow, brisk = self.turning * _slowness(motion), _briskness(motion)
        by_velocity = slow * brisk * (-2.0 / _SLOW_RAD_S**2) * motion.qd.T
        return by_velocity, slow * motion.qdd.T / (_BRISK_RAD_S2**2 * brisk)


def _slowness(motion: Motion) -> Array:
    return np.exp(-((motion.qd.T / _SLOW_RAD_S) ** 2))


def _briskness(motion: Motion) -> Array:
    return np.hypot(motion.qdd.T, _NONE_RAD_S2) / _BRISK_RAD_S2
