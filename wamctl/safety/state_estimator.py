"""From the drives' readings to the state of the arm."""

import math
from dataclasses import dataclass

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.transmission import Transmission
from wamctl.drives.interface import Readings


@dataclass(frozen=True)
class ArmState:
    """The arm at one sampling instant.

    Attributes:
        q: position [rad], shape (n,).
        qd: velocity, the filtered difference of positions [rad/s], shape (n,).
        angle_motor: motor angles behind it [rad], shape (n,).
        complete: every motor's angle was measured; otherwise the missing ones are extrapolated.
    """

    q: Array
    qd: Array
    angle_motor: Array
    complete: bool


class StateEstimator:
    """Position and velocity of the joints from the angles of the motors.

    Attributes:
        state: the newest one.

    Args:
        transmission: motors and joints.
        cutoff_hz: first-order low-pass on the differentiated position [Hz].
        angle_motor: motor angles at rest, before the first cycle, shape (n,) [rad].
    """

    def __init__(self, transmission: Transmission, cutoff_hz: float, angle_motor: Array) -> None:
        self._transmission = transmission
        self._rate = 2.0 * np.pi * cutoff_hz
        self._speed = np.zeros(len(angle_motor))
        self.state = self._state(angle_motor, complete=True)

    def update(self, readings: Readings, elapsed_s: float) -> ArmState:
        """The state at this instant.

        Args:
            readings: of this cycle.
            elapsed_s: time since the last ones [s].
        """
        before, angle = self.state.angle_motor, readings.angle_motor
        if readings.missing:
            lost = list(readings.missing)
            angle = angle.copy()
            angle[lost] = before[lost] + elapsed_s * self._speed[lost]
        share = 1.0 - math.exp(-self._rate * elapsed_s)
        self._speed = self._speed + share * ((angle - before) / elapsed_s - self._speed)
        self.state = self._state(angle, not readings.missing)
        return self.state

    def _state(self, angle: Array, complete: bool) -> ArmState:
        joints = self._transmission
        return ArmState(joints.joint_angle(angle), joints.joint_angle(self._speed), angle, complete)
