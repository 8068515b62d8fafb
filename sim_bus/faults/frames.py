"""Faults that frames meet on the bus."""

from dataclasses import dataclass

import numpy as np

from sim_bus.can_bus.frame import Frame
from sim_bus.faults.script import (
    CorruptedFrames,
    DoubledFrames,
    LateFrames,
    LostFrames,
    OnFrames,
    ReorderedFrames,
)

_MS = 1_000_000


@dataclass
class _Present:
    """A fault that is there, and the frames that it will still hit."""

    fault: OnFrames
    left: int


class FrameFaults:
    """One direction of the bus, with the faults that its frames meet.

    Args:
        random: chooses the bit that flips.
    """

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random
        self._present: list[_Present] = []
        self._late: list[tuple[int, Frame]] = []
        self._overtaken: list[Frame] = []

    def begin(self, fault: OnFrames) -> None:
        """From now on frames meet a fault."""
        self._present.append(_Present(fault, fault.number))

    def passed(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The frames that arrive in place of one that is sent now."""
        for present in self._present:
            if present.fault.id == frame.can_id:
                present.left -= 1
                self._present = [p for p in self._present if p.left > 0]
                return self._hit(present.fault, time_ns, frame)
        return [frame]

    def due(self, time_ns: int) -> list[Frame]:
        """Late frames whose time has come."""
        due = [f._replace(passed_ns=ns) for ns, f in self._late if ns <= time_ns]
        if due:
            self._late = [(r, f) for r, f in self._late if r > time_ns]
        return due

    def overtaken(self, by: Frame, opens: bool) -> list[Frame]:
        """Frames that waited to be overtaken by one with a higher identifier, or by a new cycle."""
        free = [frame for frame in self._overtaken if opens or frame.can_id < by.can_id]
        if free:
            self._overtaken = [f for f in self._overtaken if f not in free]
        return free

    def _hit(self, fault: OnFrames, time_ns: int, frame: Frame) -> list[Frame]:
        match fault:
            case LostFrames():
                return []
            case LateFrames():
                self._late.append((time_ns + round(fault.late_ms * _MS), frame))
                return []
            case DoubledFrames():
                return [frame, frame]
            case ReorderedFrames():
                self._overtaken.append(frame)
                return []
            case CorruptedFrames():
                return [self._corrupted(frame, fault.length)]

    def _corrupted(self, frame: Frame, length: int | None) -> Frame:
        data = bytearray(frame.data)
        if length is not None:
            data = data[:length].ljust(length, b"\xff")
        elif data:
            bit = int(self._random.integers(8 * len(data)))
            data[bit // 8] ^= 1 << bit % 8
        return Frame(frame.can_id, bytes(data), frame.fd)
