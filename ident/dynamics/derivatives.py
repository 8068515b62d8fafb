"""How the model's torque changes when the links are not quite where the encoders say."""

from dataclasses import dataclass

import numpy as np

from ident.dynamics.compiled_chain import Chain, torques
from ident.signals.arrays import Array

_STEP = 1e-6


@dataclass(frozen=True)
class InverseDynamicsDerivatives:
    """Derivatives of the rigid-body torque by the motion of one joint, each of shape (S, n).

    Attributes:
        position: [N m/rad].
        velocity: [N m s/rad].
        acceleration: [kg m^2].
    """

    position: Array
    velocity: Array
    acceleration: Array

    def times(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Change of the torque for changes of the joint's motion, each of shape (S,)."""
        return (
            self.position * position[:, None]
            + self.velocity * velocity[:, None]
            + self.acceleration * acceleration[:, None]
        )


def torque_slopes(
    chain: Chain, delta: Array, motion: tuple[Array, Array, Array], torque: Array, joint: int
) -> InverseDynamicsDerivatives:
    """The slopes along a motion.

    Args:
        chain: kinematics and gravity.
        delta: inertial parameters.
        motion: position, velocity and acceleration, each of shape (S, n).
        torque: the model's torque on it [N m], shape (S, n).
        joint: from 0.
    """
    found = []
    for part in range(3):
        moved = [np.ascontiguousarray(m).copy() for m in motion]
        moved[part][:, joint] += _STEP
        found.append((torques(chain, delta, *moved) - torque) / _STEP)
    return InverseDynamicsDerivatives(*found)


def rates(values: Array, period: float) -> tuple[Array, Array]:
    """First and second derivative of samples, shape (S,), by five-point differences.

    Differences over fewer points lose part of what the windows still see: a tenth at 10 Hz.

    Args:
        values: shape (S,).
        period: between samples [s].
    """
    around = np.pad(values, 2, mode="reflect", reflect_type="odd")
    first = np.convolve(around, [-1.0, 8.0, 0.0, -8.0, 1.0], "valid") / (12 * period)
    second = np.convolve(around, [-1.0, 16.0, -30.0, 16.0, -1.0], "valid") / (12 * period**2)
    return first, second
