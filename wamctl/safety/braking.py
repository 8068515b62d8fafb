"""Supervision of a stop: braking must take speed and energy out of the arm, never put any in."""

import math

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.config import ArmFile
from wamctl.arm.robot import Robot
from wamctl.errors import SafetyStopError
from wamctl.safety.state_estimator import ArmState

_GROWTH = 1.05  # what braking may make of a speed or energy
_FLOOR = 0.05  # share of the limit below which a speed is no danger, and its growth no sign
_AHEAD = 3
"""Cycles that it looks ahead along a straight line: the velocity's filter lags by two, and what is
cut off now is off in the next."""


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
        self._frames = [
            robot.model.getFrameId(frame) for frame in (limits.elbow_frame, limits.tool_frame)
        ]
        self._quantities = (
            *[(name, "rad/s") for name in robot.joint_names],
            *[(frame, "m/s") for frame in (limits.elbow_frame, limits.tool_frame)],
            ("the whole arm", "J"),
        )
        energy_j = math.inf if limits.kinetic_energy_j is None else limits.kinetic_energy_j
        speeds = (*limits.velocity_rad_s, limits.elbow_speed_m_s, limits.tool_speed_m_s)
        floor = _FLOOR * np.array([*speeds, energy_j])
        self._seen = [self._measure(state)]
        start = self._seen[0].copy()
        start[: robot.dof] = start[: robot.dof].max()
        self._most = _GROWTH * start + floor

    def check(self, state: ArmState) -> None:
        """Whether the arm will have lost speed and energy by the time that torque could be off.

        Raises:
            SafetyStopError: it gains some, so that torque must be cut off.
        """
        now, before = self._measure(state), self._seen[0]
        self._seen = [*self._seen[1 - _AHEAD :], now]
        ahead = now + (now - before) * (_AHEAD / len(self._seen[:-1]))
        worse = np.flatnonzero(ahead > self._most)
        if len(worse):
            subject, unit = self._quantities[worse[0]]
            raise SafetyStopError(
                f"braking made the arm faster: {subject} comes to {ahead[worse[0]]:.2f} {unit} "
                f"(limit {self._most[worse[0]]:.2f} {unit})",
                brakes=False,
            )

    def left(self, state: ArmState) -> str:
        """Speed and energy that are left, in words."""
        left = self._measure(state)
        return f"{np.abs(state.qd).max():.2f} rad/s and {left[-1]:.3f} J left"

    def _measure(self, state: ArmState) -> Array:
        """Speed of each joint [rad/s] and of elbow and tool [m/s], and kinetic energy [J]."""
        pin.forwardKinematics(self._model, self._data, state.q, state.qd)
        points = [
            math.hypot(*pin.getFrameVelocity(self._model, self._data, frame).linear.tolist())
            for frame in self._frames
        ]
        energy_j = pin.computeKineticEnergy(self._model, self._data)
        return np.array([*np.abs(state.qd), *points, energy_j])
