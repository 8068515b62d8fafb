"""Which torque acts when: a packed torque takes effect on arrival, in the middle of a cycle."""

import time

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.puck.wiring import PUCKS_PER_TORQUE_FRAME

TORQUE_FRAME_S = 123e-6
"""One packed torque frame on the wire: 111 us without stuff bits, 135 us with the most."""
LATCH_S = 75e-6
"""From a poll to the instant that its positions belong to (Barrett's figure, used by OWD)."""
CYCLE_ON_WIRE_S = 850e-6
"""From a poll to the last torque without time to compute (manual, p. 46): lockstep's time."""


class EffectiveTorque:
    """The mean torque between two sampling instants, which is what moves the arm between them.

    The torque of the cycle before acts until the new one arrives. Its share of the period is
    measured: from the poll to the moment of sending, plus the frames' time on the wire.

    Args:
        motors: number of motors n.
        period_s: cycle time [s].
        lockstep: the simulated arm's time stands still meanwhile, so that nothing can be measured.
    """

    def __init__(self, motors: int, period_s: float, lockstep: bool) -> None:
        self._period_s, self._lockstep = period_s, lockstep
        self._before = np.zeros(motors)
        self._on_wire_s = TORQUE_FRAME_S * (1 + np.arange(motors) // PUCKS_PER_TORQUE_FRAME)
        self._polled_s = 0.0

    def polled(self) -> None:
        """The poll of this cycle is about to be sent."""
        self._polled_s = time.monotonic()

    def mean(self, sent: Array) -> Array:
        """Mean torque from this sampling instant to the next, shape (n,).

        Args:
            sent: the torques that are about to be sent, shape (n,), in the same unit.
        """
        if self._lockstep:
            late_s = np.full_like(self._on_wire_s, CYCLE_ON_WIRE_S)
        else:
            late_s = time.monotonic() - self._polled_s - LATCH_S + self._on_wire_s
        share = np.clip(late_s / self._period_s, 0.0, 1.0)
        before, self._before = self._before, sent
        return share * before + (1.0 - share) * sent
