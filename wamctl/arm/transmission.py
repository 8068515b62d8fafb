"""Motors and joints. The one place that knows differentials, ratios, and signs."""

from dataclasses import dataclass

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.config import TransmissionSection
from wamctl.arm.errors import ConfigurationError

_LARGEST_CONDITION = 1e6


@dataclass(frozen=True)
class Transmission:
    """Lossless and linear: motor angle = A q, joint torque = A^T tau_motor.

    Products of this size take a quarter of the time by `dot` that they take by `@`.

    Attributes:
        motor_from_joint: A, shape (n, n).
        joint_from_motor: inverse of A, shape (n, n).
    """

    motor_from_joint: Array
    joint_from_motor: Array

    def joint_angle(self, angle_motor: Array) -> Array:
        """Joint angle [rad] or velocity [rad/s] of the motors' one, shape (n,)."""
        return self.joint_from_motor.dot(angle_motor)

    def motor_angle(self, q: Array) -> Array:
        """Motor angle [rad] or velocity [rad/s] of the joints' one, shape (n,)."""
        return self.motor_from_joint.dot(q)

    def motor_torque(self, tau: Array) -> Array:
        """Motor torque [N m] that gives joint torque tau [N m], shape (n,)."""
        return tau.dot(self.joint_from_motor)

    def joint_torque(self, tau_motor: Array) -> Array:
        """Joint torque [N m] that motor torque tau_motor [N m] gives, shape (n,)."""
        return tau_motor.dot(self.motor_from_joint)


def transmission(section: TransmissionSection, source: str) -> Transmission:
    """The transmission of a configuration.

    Raises:
        ConfigurationError: two motors turn with the same mix of joints, so that a joint has none.
    """
    matrix = np.array(section.motor_from_joint)
    condition = np.linalg.cond(matrix)
    if not condition < _LARGEST_CONDITION:
        raise ConfigurationError(
            source,
            [
                "transmission.motor_from_joint: the matrix cannot be inverted (condition number "
                f"{condition:.3g}), so that some joint has no motor of its own"
            ],
        )
    return Transmission(matrix, np.linalg.inv(matrix))
