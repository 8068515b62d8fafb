"""Supervision of a stop: braking must take speed and energy out of the arm, never put any in."""

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from wamctl.arm.config import ArmFile
from wamctl.arm.robot import Robot
from wamctl.errors import SafetyStopError
from wamctl.safety.state_estimator import ArmState

Array = NDArray[np.floating]

_GROWTH = 1.1  # what braking may make of a speed or energy: the estimate lags by some milliseconds
_FLOOR = 0.05  # share of the limit below which a speed is no danger, and its growth no sign


class BrakingMonitor:
    """Compares every cycle of braking with the state in which braking began.

    A motor with the wrong sign, or a load that the model does not know, turns braking into
    acceleration. Cutting the torque then leaves the arm slower than braking on.

    Args:
        arm: limits.
        robot: rigid-body model.
        state: of the arm when braking begins.
    """

    def __init__(self, arm: ArmFile, robot: Robot, state: ArmState) -> None:
        limits = arm.limits
        self._model, self._data = robot.model, robot.data()
        self._names = robot.joint_names
        self._frames = [
            robot.model.getFrameId(frame) for frame in (limits.elbow_frame, limits.tool_frame)
        ]
        self._points = (limits.elbow_frame, limits.tool_frame)
        points = np.array([limits.elbow_speed_m_s, limits.tool_speed_m_s])
        energy_j = limits.kinetic_energy_j
        speeds, at_points, energy = self._measure(state)
        self._speeds = _GROWTH * speeds.max() + _FLOOR * np.array(limits.velocity_rad_s)
        self._at_points = _GROWTH * at_points + _FLOOR * points
        self._energy_j = math.inf if energy_j is None else _GROWTH * energy + _FLOOR * energy_j

    def check(self, state: ArmState) -> None:
        """Whether the arm still loses speed and energy.

        Raises:
            SafetyStopError: it gains some, so that torque must be cut off.
        """
        speeds, at_points, energy_j = self._measure(state)
        for subject, value, most, unit in (
            *zip(self._names, speeds, self._speeds, ["rad/s"] * len(speeds), strict=True),
            *zip(self._points, at_points, self._at_points, ["m/s"] * 2, strict=True),
            ("the whole arm", energy_j, self._energy_j, "J"),
        ):
            if value > most:
                raise SafetyStopError(
                    f"braking made the arm faster: {subject} reached {value:.2f} {unit} (limit "
                    f"{most:.2f} {unit})",
                    brakes=False,
                )

    def left(self, state: ArmState) -> str:
        """Speed and energy that are left, in words."""
        speeds, _, energy_j = self._measure(state)
        return f"{speeds.max():.2f} rad/s and {energy_j:.3f} J left"

    def _measure(self, state: ArmState) -> tuple[Array, Array, float]:
        """Speed of each joint [rad/s] and of elbow and tool [m/s], and kinetic energy [J]."""
        pin.forwardKinematics(self._model, self._data, state.q, state.qd)
        points = [
            math.hypot(*pin.getFrameVelocity(self._model, self._data, frame).linear.tolist())
            for frame in self._frames
        ]
        energy_j = pin.computeKineticEnergy(self._model, self._data)
        return np.abs(state.qd), np.array(points), energy_j
