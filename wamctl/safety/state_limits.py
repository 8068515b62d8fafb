"""Limits of the arm's state: position, velocity, speed, energy, tracking error, readings."""

import math

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.config import ArmFile
from wamctl.arm.control import Setpoint
from wamctl.arm.joint_labels import numbered_joints
from wamctl.arm.robot import Robot
from wamctl.arm.transmission import Transmission
from wamctl.errors import SafetyStopError
from wamctl.safety.state_estimator import ArmState

_JUMP = 2.0  # times the fastest allowed motion: what one cycle may not exceed
_STUCK = 0.5  # share of the tracking limit that a motor's reference may go while its encoder rests


class StateLimits:
    """Watches the arm's state against its limits, cycle by cycle.

    Args:
        arm: limits and margins.
        robot: kinematics, for the speed of elbow and tool.
        transmission: motors and joints.
    """

    def __init__(self, arm: ArmFile, robot: Robot, transmission: Transmission) -> None:
        limits, safety = arm.limits, arm.safety
        velocity = np.array(limits.velocity_rad_s) * safety.velocity_margin
        margin, tracking = safety.position_margin_rad, np.array(safety.tracking_error_rad)
        self._names = numbered_joints(robot.joint_names)
        self._lower = np.concatenate([np.array(limits.position_lower_rad) - margin, -velocity])
        self._upper = np.concatenate([np.array(limits.position_upper_rad) + margin, velocity])
        self._values = np.empty_like(self._lower)
        self._tracking = tracking
        self._transmission = transmission
        mixing = np.abs(transmission.motor_from_joint)
        self._motor_step = _JUMP * mixing @ velocity  # [rad/s]
        self._motor_stuck = _STUCK * np.where(mixing > 0, mixing * tracking, np.inf).min(axis=1)
        self._model, self._data = robot.model, robot.data()
        energy_j = limits.kinetic_energy_j
        self._energy_j = math.inf if energy_j is None else energy_j
        self._points = [
            (frame, robot.model.getFrameId(frame), speed)
            for frame, speed in (
                (limits.elbow_frame, limits.elbow_speed_m_s),
                (limits.tool_frame, limits.tool_speed_m_s),
            )
        ]
        self._braking_s = safety.braking_s / 2.0  # to stop from a speed takes half of its way
        self._lag = 1.0 / (2.0 * np.pi * arm.controller.velocity_cutoff_hz * arm.bus.period_s)
        self._qd: Array | None = None
        self._angle: Array | None = None
        self._reference = np.zeros(len(mixing))  # of each motor, when its encoder last moved
        self._moved = np.ones(
            len(mixing), dtype=bool
        )  # encoders, since the reference was looked at

    def check_readings(self, angle_motor: Array, elapsed_s: float) -> None:
        """Whether the motors can have turned so far since the last cycle.

        Raises:
            SafetyStopError: no; a reading is wrong, so that the arm cannot be braked by it.
        """
        last, self._angle = self._angle, angle_motor
        if last is None:
            return
        step, most = np.abs(angle_motor - last), self._motor_step * elapsed_s
        if np.count_nonzero(step > most):
            k = int(np.argmax(step / most))
            raise SafetyStopError(
                f"position of motor {k + 1} jumped by {step[k]:.3f} rad in {elapsed_s * 1e3:.1f} ms"
                f" (limit {most[k]:.3f} rad)",
                brakes=False,
            )
        self._moved |= step > 0.0

    def check(self, state: ArmState) -> None:
        """Position where braking would end, velocity ahead of its filter, speeds, and energy.

        Raises:
            SafetyStopError: a limit was passed.
        """
        values, n = self._values, len(state.q)
        last = state.qd if self._qd is None else self._qd
        values[:n] = state.q + self._braking_s * state.qd
        values[n:] = state.qd + self._lag * (state.qd - last)
        self._qd = state.qd
        outside = (values < self._lower) | (values > self._upper)
        if np.count_nonzero(outside):
            raise self._passed(values, int(np.flatnonzero(outside)[0]), state.q)
        pin.forwardKinematics(self._model, self._data, state.q, state.qd)
        for name, frame, most in self._points:
            motion = pin.getFrameVelocity(self._model, self._data, frame)
            speed = math.hypot(*motion.linear.tolist())
            if speed > most:
                raise SafetyStopError(
                    f"speed of {name} is {speed:.3f} m/s, above its limit of {most:.3f} m/s"
                )
        energy_j = pin.computeKineticEnergy(self._model, self._data)
        if energy_j > self._energy_j:
            raise SafetyStopError(
                f"kinetic energy of the arm is {energy_j:.2f} J, above its limit of "
                f"{self._energy_j:g} J"
            )

    def check_tracking(self, state: ArmState, wanted: Setpoint) -> None:
        """Whether the arm follows, and whether every encoder moves when it should.

        Raises:
            SafetyStopError: a joint is too far from its reference, or an encoder stands still.
        """
        error = np.abs(wanted.q - state.q)
        if np.count_nonzero(error > self._tracking):
            k = int(np.argmax(error / self._tracking))
            raise SafetyStopError(
                f"tracking error of {self._names[k]} is {error[k]:.3f} rad, above "
                f"its limit of {self._tracking[k]:.3f} rad"
            )
        reference = self._transmission.motor_angle(wanted.q)
        np.copyto(self._reference, reference, where=self._moved)
        self._moved.fill(False)
        way = np.abs(reference - self._reference)
        if np.count_nonzero(way > self._motor_stuck):
            k = int(np.argmax(way / self._motor_stuck))
            raise SafetyStopError(
                f"encoder of motor {k + 1} stands still while its reference went {way[k]:.2f} rad "
                f"(limit {self._motor_stuck[k]:.2f} rad)",
                brakes=False,
            )

    def _passed(self, values: Array, place: int, q: Array) -> SafetyStopError:
        n = len(self._names)
        what, unit = ("position", "rad") if place < n else ("velocity", "rad/s")
        value, below = values[place], values[place] < self._lower[place]
        bound = self._lower[place] if below else self._upper[place]
        is_there = place >= n or not self._lower[place] <= q[place] <= self._upper[place]
        return SafetyStopError(
            f"{what} of {self._names[place % n]} {'is' if is_there else 'comes by braking to'} "
            f"{value:.3f} {unit}, {'below' if below else 'above'} its limit of {bound:.3f} {unit}"
        )
