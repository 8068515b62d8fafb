"""One bus: one frame at a time, the lowest waiting identifier first, none interrupted."""

import heapq
from dataclasses import dataclass

from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.frame_length import GAP_BITS, BitTiming, frame_ns, warm_up

_SECOND_NS = 1_000_000_000

_Offer = tuple[int, int, int, Frame, object]
"""Sort key, a unique number, the frame's length [ns], the frame, its sender."""


@dataclass(frozen=True)
class Arrival:
    """A frame whose last bit has passed.

    Attributes:
        time_ns: when its last bit passed [ns].
        frame: the frame.
        sender: whoever offered it.
    """

    time_ns: int
    frame: Frame
    sender: object


class Load:
    """Load of a bus.

    Attributes:
        frames: how many have been sent.
        peak: greatest share of any one second that the bus was busy, up to 1.
    """

    def __init__(self) -> None:
        self.frames = 0
        self.peak = 0.0
        self._second = 0
        self._busy_ns = 0

    def add(self, start_ns: int, end_ns: int) -> None:
        """A frame and the gap behind it; frames come in their order."""
        self.frames += 1
        second = start_ns // _SECOND_NS
        if second != self._second:
            self._second, self._busy_ns = second, 0
        self._busy_ns += end_ns - start_ns
        self.peak = max(self.peak, self._busy_ns / _SECOND_NS)


class Arbitration:
    """The arbitration of one CAN bus, on any clock whose time is given as an argument [ns].

    Frames may be offered with a time later than the present, as answers that a drive will give.

    Attributes:
        load: how busy the bus was.
    """

    def __init__(self, timing: BitTiming) -> None:
        self._timing = timing
        self._gap_ns = round(GAP_BITS * 1e9 / timing.nominal_bit_s)
        self._free_ns = 0
        self._pending: list[_Offer] = []  # by when they may start
        self._waiting: list[_Offer] = []  # by identifier
        self._current: Arrival | None = None
        self._offered = 0
        self.load = Load()
        warm_up(timing)

    def offer(self, time_ns: int, frame: Frame, sender: object) -> None:
        """A frame that is ready to be sent from `time_ns` on."""
        self._offered += 1
        length_ns = frame_ns(frame, self._timing)
        heapq.heappush(self._pending, (time_ns, self._offered, length_ns, frame, sender))

    def take(self, time_ns: int) -> Arrival | None:
        """The next frame whose last bit has passed by `time_ns`; None when there is none yet."""
        self._arbitrate(time_ns)
        if self._current is None or self._current.time_ns > time_ns:
            return None
        arrival, self._current = self._current, None
        return arrival

    def next_ns(self) -> int | None:
        """When `take` will have a frame if nothing else is offered; None for an idle bus."""
        if self._current is not None:
            return self._current.time_ns
        ready = self._free_ns if self._waiting else None
        if self._pending:
            ready = max(self._free_ns, self._pending[0][0])
        return ready

    @property
    def is_busy(self) -> bool:
        """Whether a frame was under way at the instant of the last `take`."""
        return self._current is not None

    def pause_ns(self) -> int | None:
        """When the last of the frames that follow each other without a pause will have passed.

        That is, if nothing else is offered; None for an idle bus.
        """
        end = self._free_ns
        if self._current is None and not self._waiting:
            if not self._pending:
                return None
            end = max(end, self._pending[0][0])
        for _, _, length_ns, _, _ in self._waiting:
            end += length_ns + self._gap_ns
        for time_ns, _, length_ns, _, _ in sorted(self._pending):
            if time_ns > end:
                break
            end += length_ns + self._gap_ns
        return end - self._gap_ns

    def _arbitrate(self, time_ns: int) -> None:
        if self._current is not None or not (self._waiting or self._pending):
            return
        start = self._free_ns
        if not self._waiting:
            start = max(start, self._pending[0][0])
        if start > time_ns:
            return
        while self._pending and self._pending[0][0] <= start:
            _, order, length_ns, frame, sender = heapq.heappop(self._pending)
            offer = (frame.can_id & 0x1FFF_FFFF, order, length_ns, frame, sender)
            heapq.heappush(self._waiting, offer)
        _, _, length_ns, frame, sender = heapq.heappop(self._waiting)
        end = start + length_ns
        self._current = Arrival(end, frame, sender)
        self._free_ns = end + self._gap_ns
        self.load.add(start, self._free_ns)
