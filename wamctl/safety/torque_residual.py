"""Torque that the motors were told to give and that the arm's motion does not show."""

import math

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.robot import Robot
from wamctl.arm.transmission import Transmission
from wamctl.safety.state_estimator import ArmState

_CUTOFF_HZ = 10.0  # as fast as an acceleration from whole encoder counts allows


class TorqueResidual:
    """Commanded torque less what the model needs for the measured motion: tau - M qdd - c - g.

    In a healthy arm it is friction, what the model lacks, and what pushes the arm. A motor that
    gives no torque leaves all of it over; an encoder that stands still shows a stop that no torque
    has made. Torque and acceleration pass the same low-pass filters.

    Args:
        robot: rigid-body model.
        transmission: motors and joints.
        velocity_cutoff_hz: of the low-pass behind the measured velocity [Hz].
    """

    def __init__(self, robot: Robot, transmission: Transmission, velocity_cutoff_hz: float) -> None:
        self._model, self._data = robot.model, robot.data()
        self._transmission = transmission
        self._rates = 2.0 * np.pi * velocity_cutoff_hz, 2.0 * np.pi * _CUTOFF_HZ
        self._qd: Array | None = None

    def start(self) -> None:
        """Forget what was; the arm is taken for one at rest with just the torque that it needs."""
        self._qd = None

    def update(self, state: ArmState, tau: Array, elapsed_s: float) -> Array:
        """The residual on the motors' side [N m], shape (n,).

        Args:
            state: of this instant.
            tau: joint torque that has acted since the last one [N m], shape (n,).
            elapsed_s: since then [s].
        """
        if self._qd is None:
            zero = np.zeros_like(state.qd)
            needed = pin.rnea(self._model, self._data, state.q, state.qd, zero)
            self._qd, self._acceleration = state.qd, zero
            self._first, self._torque = needed.copy(), needed.copy()
        fast, slow = (1.0 - math.exp(-rate * elapsed_s) for rate in self._rates)
        self._acceleration += slow * ((state.qd - self._qd) / elapsed_s - self._acceleration)
        self._qd = state.qd
        self._first += fast * (tau - self._first)
        self._torque += slow * (self._first - self._torque)
        needed = pin.rnea(self._model, self._data, state.q, state.qd, self._acceleration)
        return self._transmission.motor_torque(self._torque - needed)
