"""When the next cycle starts: on absolute deadlines, or as soon as the last one is done."""

import time
from typing import Protocol

from wamctl.drives.bus import SimulatedTime
from wamctl.drives.interface import WINDOW

_LOCKSTEP_START_NS = 946_684_800_000_000_000  # 2000-01-01, so that two runs have the same stamps
_KEPT_S = 1e-4  # a bus that keeps its own time has given all when it begins to count ours
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

    def age(self, stamp_s: float) -> float:
        """Time from this cycle's SYNC to a frame's time stamp [s]; negative for older frames.

        Zero where frames are not stamped by a clock that is known here.
        """
        ...

    @property
    def waited(self) -> int:
        """Periods that this cycle has waited for frames so far, at least 1."""
        ...

    def elapsed_ns(self) -> int:
        """Time since the last tick [ns]."""
        ...


class RealTimeClock:
    """Absolute deadlines on the monotonic clock; those that were overrun are not made up for.

    Args:
        period_s: cycle time [s].
        stamped: frames are stamped as they pass, by the clock of `time.time`.
        overtime: periods by which a patient cycle may be held up for a late frame. It is rather
            waited for than lost, since the drives hold their torque meanwhile.
    """

    waits = False

    def __init__(self, period_s: float, stamped: bool = False, overtime: float = 0.0) -> None:
        self.latency_ns = 0
        self.skipped = 0
        self.patient = True
        self._period_ns = round(period_s * 1e9)
        self._window_ns = round(WINDOW * self._period_ns)
        self._overtime_ns = round(overtime * self._period_ns)
        self._stamped, self._started_s = stamped, 0.0
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
        self._started_s = time.time_ns() * 1e-9  # anew in each cycle, since it may be set
        return now + self._offset_ns

    def remaining(self) -> float:
        """Time left in this cycle to wait for frames [s]."""
        window = self._window_ns + (self._overtime_ns if self.patient else 0)
        return (self._started_ns + window - time.monotonic_ns()) * 1e-9

    def age(self, stamp_s: float) -> float:
        """Time from this cycle's SYNC to a frame's time stamp [s]; negative for older frames."""
        return stamp_s - self._started_s if self._stamped else 0.0

    @property
    def waited(self) -> int:
        """Periods that this cycle has waited for frames so far, at least 1."""
        most = self._window_ns + self._overtime_ns
        return 1 + min(self.elapsed_ns(), most) // self._period_ns

    def elapsed_ns(self) -> int:
        """Time since the last tick [ns]."""
        return time.monotonic_ns() - self._started_ns


class LockstepClock:
    """The next cycle starts when the last one is done; stamps advance by exactly one period.

    On the embedded bus, waiting begins only when the arm has answered all that was sent, so that no
    result depends on the machine. On other buses an arm answers each cycle in one go: whoever has
    its first frame has the others at once, but on a busy machine the first may take long.

    Args:
        period_s: cycle time [s].
        keeper: the bus, where it has a time of its own.
    """

    waits = True
    waited = 1

    def __init__(self, period_s: float, keeper: SimulatedTime | None = None) -> None:
        self._keeper = keeper
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
        if self._keeper:
            return _KEPT_S
        if not self.patient:
            return _MISSED_FRAME_S
        return _FIRST_FRAME_S if self._asked == 1 else _NEXT_FRAME_S

    def age(self, stamp_s: float) -> float:
        """Time from this cycle's SYNC, where the bus's time stands still, to a stamp [s]."""
        now_s = self._keeper.now_s if self._keeper else None
        return 0.0 if now_s is None else stamp_s - now_s

    def elapsed_ns(self) -> int:
        """Time since the last tick [ns]."""
        return time.monotonic_ns() - self._started_ns
