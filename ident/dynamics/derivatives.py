"""How the model's torque changes when the links are not quite where the encoders say."""

from dataclasses import dataclass

import numpy as np

from ident.dynamics.compiled_chain import Chain, torques
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

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


@compiled
def rates(values, period):
    """First and second derivative of samples, each of shape (S,), by five-point differences.

    Differences over fewer points lose part of what the windows still see: a tenth at 10 Hz.

    Args:
        values: shape (S,), three or more; they go on beyond the ends as before them, turned about.
        period: between samples [s].
    """
    n = values.size
    around = np.empty(n + 4)
    around[2 : n + 2] = values
    for k in range(1, 3):
        around[2 - k] = 2.0 * values[0] - values[k]
        around[n + 1 + k] = 2.0 * values[n - 1] - values[n - 1 - k]
    first, second = np.empty(n), np.empty(n)
    for k in range(n):
        a, b, c, d, e = around[k], around[k + 1], around[k + 2], around[k + 3], around[k + 4]
        first[k] = (a - 8.0 * b + 8.0 * d - e) / (12.0 * period)
        second[k] = (-a + 16.0 * b - 30.0 * c + 16.0 * d - e) / (12.0 * period**2)
    return first, second
