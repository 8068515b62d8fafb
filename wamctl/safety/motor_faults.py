"""Whether every motor does what it is told, and its encoder sees it."""

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.arrays import Array
from wamctl.arm.config import ArmFile
from wamctl.arm.robot import Robot
from wamctl.arm.transmission import Transmission
from wamctl.errors import SafetyStopError
from wamctl.safety.state_estimator import ArmState
from wamctl.safety.torque_residual import TorqueResidual

_CYCLES = 2  # in a row with too much torque left over
_STILL_S = 0.012
_STILL_ABOVE = 0.8  # share of the limit: a cycle in which it is silent hides 5 % of its torque
_SUSPECT = 0.5  # share of the limit left over from which a motor takes no part in braking
_SHAKEN_S = 0.1  # within which torque is left over both ways: no motor that fails does so
_SETTLING_S = 0.1  # in which an arm that has just got torque takes up its load
_FAST_RAD_S, _FAST_COUNTS = 6.0, 8.0  # motor speed from which nothing stops within a cycle


class MotorFaults:
    """Compares reading, torque and motion of every motor.

    A motor that friction stops slows down count by count; a reading that stands still right behind
    a fast one is no motion. A torque that the motion does not show is judged by the model. A motor
    with the wrong sign brakes the wrong way, and makes the arm faster as long as it is driven; one
    without torque loses nothing when it is not.

    Attributes:
        doubtful: motors with too much torque left over, and those that turn the same joints, which
            are not to be driven while a further cycle tells, booleans, shape (n,).

    Args:
        arm: limits; without `safety.unaccounted_torque_nm` torque is not watched.
        robot: rigid-body model.
        transmission: motors and joints.
    """

    def __init__(self, arm: ArmFile, robot: Robot, transmission: Transmission) -> None:
        period_s = arm.bus.period_s
        count = 2.0 * np.pi / np.array(arm.drives.counts_per_revolution)
        self._fast = np.maximum(_FAST_COUNTS * count, _FAST_RAD_S * period_s) - count / 2
        self._still_cycles = round(_STILL_S / period_s)
        self._shaken_cycles = round(_SHAKEN_S / period_s)
        self._settling_cycles = round(_SETTLING_S / period_s)
        self._limit = np.array(arm.safety.unaccounted_torque_nm)
        self._residual = TorqueResidual(robot, transmission, arm.controller.velocity_cutoff_hz)
        self._period_s = period_s
        self._share_a_joint = (matrix := transmission.motor_from_joint != 0.0) @ matrix.T
        self.rest()

    def rest(self) -> None:
        """A cycle in which the arm need not obey, held by something or let go."""
        self._residual.start()
        self._angle: Array | None = None
        self._settling = self._settling_cycles
        self._above = np.zeros(len(self._fast), dtype=int)  # cycles in a row above the limit
        self._left = np.zeros(len(self._limit))
        self._since = np.full((2, len(self._limit)), self._shaken_cycles)  # it was left either way
        self.doubtful = self._above > 0

    def check(self, state: ArmState, tau: Array, elapsed_s: float) -> None:
        """Whether readings and torque since the last cycle fit each other, after 0.1 s of driving.

        Args:
            state: of this instant.
            tau: joint torque that has acted since the last one [N m], shape (n,).
            elapsed_s: for so long [s].

        Raises:
            SafetyStopError: an encoder has stopped at once, or too much torque is left over.
        """
        if self._settling > 0:
            self._settling -= 1
            return
        self._check_encoders(state)
        if len(self._limit):
            self._left = self._residual.update(state, tau, elapsed_s)
            self._check_torques(self._left)

    @property
    def suspects(self) -> NDArray[np.bool_]:
        """Motors by which an arm that is not well is not to be braked, as `doubtful`."""
        if not len(self._limit):
            return self.doubtful
        return self._share_a_joint @ (np.abs(self._left) > _SUSPECT * self._limit)

    def _check_encoders(self, state: ArmState) -> None:
        last, self._angle = self._angle, state.angle_motor if state.complete else None
        if last is None or self._angle is None:
            self._still = np.zeros(len(self._fast), dtype=int)  # cycles since each reading moved
            self._step = np.zeros(len(self._fast))  # [rad] when it did
            return
        step = np.abs(self._angle - last)
        moved = step > 0.0
        self._still += 1
        self._still[moved] = 0
        np.copyto(self._step, step, where=moved)
        if not np.count_nonzero(self._still >= self._still_cycles):
            return
        stuck = (self._still >= self._still_cycles) & (self._step > self._fast)
        if np.count_nonzero(stuck):
            k = int(np.flatnonzero(stuck)[0])
            speed, limit = self._step[k] / self._period_s, self._fast[k] / self._period_s
            raise SafetyStopError(
                f"encoder of motor {k + 1} stopped at once from {speed:.1f} rad/s and has stood "
                f"still for {self._still[k]} cycles, which no motor can (limit {limit:.1f} rad/s)",
                brakes=False,
            )

    def _check_torques(self, left: Array) -> None:
        much = _SUSPECT * self._limit
        self._since = np.where([left > much, left < -much], 0, self._since + 1)
        above = np.abs(left) > np.where(self._above > 0, _STILL_ABOVE, 1.0) * self._limit
        if not np.count_nonzero(above):
            self._above.fill(0)
            self.doubtful = above
            return
        self.doubtful = self._share_a_joint @ above
        self._above = np.where(above, self._above + 1, 0)
        above = self._above >= _CYCLES
        if not np.count_nonzero(above):
            return
        k = int(np.argmax(np.where(above, np.abs(left) / self._limit, 0.0)))
        cause = (
            f"motor {k + 1} does not move as it is driven: {abs(left[k]):.3f} N m of its torque "
            f"are left over (limit {self._limit[k]:g} N m)"
        )
        if self._since[:, k].max() < self._shaken_cycles:
            cause += (
                ", this way and that: the arm shakes, as where a joint gives way and "
                "controller.bandwidth_rad_s is too high for it"
            )
        still = self._still[k] >= _CYCLES  # a stop that came with it: not to be braked by
        raise SafetyStopError(
            f"{cause}, and its encoder stands still" if still else cause, brakes=not still
        )
