"""When the next cycle starts: on absolute deadlines, or as soon as the last one is done."""

import time
from typing import Protocol

_WINDOW = 0.8  # share of the period in which the drives' frames are awaited
_LOCKSTEP_START_NS = 946_684_800_000_000_000  # 2000-01-01, so that two runs have the same stamps
_FIRST_FRAME_S = 5.0
_NEXT_FRAME_S = 1.0
_MISSED_FRAME_S = 0.1  # one frame is missing: the next one will be, too


class Clock(Protocol):
    """Paces the cycles.

    Attributes:
        latency_ns: how late the last cycle started.
        skipped: deadlines that passed unused before the last cycle.
        waits: whether the world stands still between cycles, so that the loop may wait for others.
        patient: whether a late frame is worth waiting for, since the last cycle was complete.
    """

    latency_ns: int
    skipped: int
    waits: bool
    patient: bool

    def start(self) -> None:
        """The first cycle is due one period from now."""
        ...

    def tick(self) -> int:
        """Wait for the next cycle; returns its stamp [ns since 1970]."""
        ...

    def remaining(self) -> float:
        """Time left in this cycle to wait for frames [s]."""
        ...

    def elapsed_ns(self) -> int:
        """Time since the last tick [ns]."""
        ...


class RealTimeClock:
    """Absolute deadlines on the monotonic clock; those that were overrun are not made up for.

    Args:
        period_s: cycle time [s].
        overtime: periods by which a patient cycle may be held up for a late frame. It is rather
            waited for than lost, since the drives hold their torque meanwhile.
    """

    waits = False

    def __init__(self, period_s: float, overtime: float = 0.0) -> None:
        self.latency_ns = 0
        self.skipped = 0
        self.patient = True
        self._period_ns = round(period_s * 1e9)
        self._window_ns = round(_WINDOW * self._period_ns)
        self._overtime_ns = round(overtime * self._period_ns)
        self._started_ns = 0
        self._next_ns = 0
        self._offset_ns = 0

    def start(self) -> None:
        """The first cycle is due one period from now."""
        self._offset_ns = time.time_ns() - time.monotonic_ns()
        self._next_ns = time.monotonic_ns() + self._period_ns

    def tick(self) -> int:
        """Wait for the next cycle; returns its stamp [ns since 1970]."""
        due = self._next_ns
        ahead = due - time.monotonic_ns()
        if ahead > 0:
            time.sleep(ahead * 1e-9)
        now = time.monotonic_ns()
        self.latency_ns = now - due
        self.skipped = self.latency_ns // self._period_ns
        self._next_ns = due + (self.skipped + 1) * self._period_ns
        self._started_ns = now
        return now + self._offset_ns

    def remaining(self) -> float:
        """Time left in this cycle to wait for frames [s]."""
        window = self._window_ns + (self._overtime_ns if self.patient else 0)
        return (self._started_ns + window - time.monotonic_ns()) * 1e-9

    def elapsed_ns(self) -> int:
        """Time since the last tick [ns]."""
        return time.monotonic_ns() - self._started_ns


class LockstepClock:
    """The next cycle starts when the last one is done; stamps advance by exactly one period.

    On the embedded bus, waiting begins only when the arm has answered all that was sent, so that no
    result depends on the machine. On other buses an arm answers each cycle in one go: whoever has
    its first frame has the others at once, but on a busy machine the first may take long.
    """

    waits = True

    def __init__(self, period_s: float) -> None:
        self.latency_ns = 0
        self.skipped = 0
        self.patient = True
        self._period_ns = round(period_s * 1e9)
        self._stamp_ns = _LOCKSTEP_START_NS
        self._started_ns = 0
        self._asked = 0

    def start(self) -> None:
        """The first cycle is due at once."""
        self._started_ns = time.monotonic_ns()

    def tick(self) -> int:
        """The stamp of the next cycle [ns since 1970]."""
        self._asked = 0
        self._stamp_ns += self._period_ns
        self._started_ns = time.monotonic_ns()
        return self._stamp_ns

    def remaining(self) -> float:
        """Time to wait for the next frame of this cycle [s]."""
        self._asked += 1
        if not self.patient:
            return _MISSED_FRAME_S
        return _FIRST_FRAME_S if self._asked == 1 else _NEXT_FRAME_S

    def elapsed_ns(self) -> int:
        """Time since the last tick [ns]."""
        return time.monotonic_ns() - self._started_ns
