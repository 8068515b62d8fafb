"""How punctual the loop was."""

from dataclasses import dataclass

import numpy as np

_ROOM = 1 << 16


@dataclass(frozen=True)
class Percentiles:
    """Of a duration [us]."""

    p50: float
    p99: float
    p99_9: float
    most: float


class Timing:
    """Wake-up latency and length of every cycle, and the deadlines that were missed."""

    def __init__(self) -> None:
        self.missed = 0
        self.cycles = 0
        self._us = np.zeros((_ROOM, 2))

    def record(self, latency_ns: int, cycle_ns: int, skipped: int) -> None:
        """One cycle.

        Args:
            latency_ns: how late it started.
            cycle_ns: from its start to its last torque frame.
            skipped: deadlines that passed unused before it.
        """
        if self.cycles == len(self._us):
            self._us = np.concatenate([self._us, np.zeros_like(self._us)])
        row = self._us[self.cycles]
        row[0], row[1] = latency_ns * 1e-3, cycle_ns * 1e-3
        self.cycles += 1
        self.missed += skipped

    def latency(self) -> Percentiles:
        """Wake-up after the deadline [us]."""
        return percentiles(self._us[: self.cycles, 0])

    def cycle(self) -> Percentiles:
        """From SYNC to the last torque frame [us]."""
        return percentiles(self._us[: self.cycles, 1])


def percentiles(us: np.ndarray) -> Percentiles:
    """Percentiles of durations, shape (S,) [us]; zeros where there are none."""
    if len(us) == 0:
        return Percentiles(0.0, 0.0, 0.0, 0.0)
    return Percentiles(*(float(p) for p in np.percentile(us, [50, 99, 99.9, 100])))
