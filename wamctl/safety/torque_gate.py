"""The gate that every torque passes: limit, slew and power of the motors."""

import math

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.errors import SafetyStopError


class TorqueGate:
    """Every torque passes here, on the motors' side, and nowhere else.

    Args:
        limit: largest torque per motor, shape (n,) [N m].
        slew: fastest change per motor, shape (n,) [N m/s].
        power_w: largest power of all motors together [W]; None for any.

    Attributes:
        clipped: torques so far that were wanted larger or faster.
        silent: motors that give none, whatever is wanted, booleans, shape (n,).
    """

    def __init__(self, limit: Array, slew: Array, power_w: float | None = None) -> None:
        self.clipped = 0
        self.silent = np.zeros(len(limit), dtype=bool)
        self._limit, self._opposite, self._slew = limit, -limit, slew
        self._power_w = math.inf if power_w is None else power_w
        self._last = np.zeros(len(limit))

    def admit(self, tau_motor: Array, speed_motor: Array, elapsed_s: float) -> Array:
        """The torque that may be sent [N m], shape (n,): within limit, slew and power.

        Args:
            tau_motor: wanted torque [N m], shape (n,).
            speed_motor: of the motors [rad/s], shape (n,).
            elapsed_s: since the last torque [s].

        Raises:
            SafetyStopError: a torque is no number, or all together would give too much power.
        """
        if np.count_nonzero(np.isfinite(tau_motor)) < len(tau_motor):
            motor = int(np.flatnonzero(~np.isfinite(tau_motor))[0])
            raise SafetyStopError(
                f"torque of motor {motor + 1} came out as {tau_motor[motor]} N m, not a number",
                brakes=False,
            )
        step = self._slew * elapsed_s
        low = np.maximum(self._last - step, self._opposite)
        high = np.minimum(self._last + step, self._limit)
        passed = np.minimum(np.maximum(tau_motor, low), high)
        passed[self.silent] = 0.0
        power_w = float(passed.dot(speed_motor))
        if power_w > self._power_w:
            raise SafetyStopError(
                f"the motors would put {power_w:.1f} W into the arm, above the limit of "
                f"{self._power_w:g} W"
            )
        self._last = passed
        self.clipped += int(np.count_nonzero(passed != tau_motor))
        return passed

    def zero(self) -> Array:
        """No torque, at once."""
        self._last = np.zeros(len(self._limit))
        return self._last
