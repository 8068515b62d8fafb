"""The loop's end of the watchdog: a heart in shared memory that beats once a cycle."""

import json
import mmap
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import can
from can.interfaces.socketcan.socketcan import build_can_frame

from wamctl.errors import BusError
from wamctl.safety.watchdog_process import BEATS, DONE, FIRED, HEART_BYTES, READY, WATCHED
from wamctl.telemetry.child_process import ChildProcess

_START_S, _END_S = 20.0, 1.0
_MARGIN_CYCLES = 4  # beyond what the loop itself allows


class Heart:
    """What the loop does to be taken for alive; this one is watched by nobody."""

    has_been_taken_for_dead = False
    """Whether torque was taken away because the heart stood still."""

    def beat(self) -> None:
        """The loop is alive: once a cycle."""

    def begin(self) -> None:
        """From now on there may be torque."""

    def rest(self) -> None:
        """From now on there is none, and no beat is needed."""


NOBODY_WATCHES = Heart()


class WatchedHeart(Heart):
    """A heart in shared memory, for another process to look at."""

    def __init__(self, descriptor: int) -> None:
        self._places = memoryview(mmap.mmap(descriptor, HEART_BYTES)).cast("q")

    @property
    def has_been_taken_for_dead(self) -> bool:
        """Whether torque was taken away because the heart stood still."""
        return bool(self._places[FIRED])

    def beat(self) -> None:
        """The loop is alive: once a cycle."""
        self._places[BEATS] += 1

    def begin(self) -> None:
        """From now on there may be torque."""
        self.beat()
        self._places[WATCHED] = 1

    def rest(self) -> None:
        """From now on there is none, and no beat is needed."""
        self._places[WATCHED] = 0


def silence_s(period_s: float, missed_cycles: int) -> float:
    """How long the heart may stand still [s]: longer than the loop itself allows in any case."""
    return (2 * missed_cycles + _MARGIN_CYCLES) * period_s


@contextmanager
def watched(bus: can.BusABC, frames: Sequence[can.Message], silence_s: float) -> Iterator[Heart]:
    """A heart that a process of its own watches; without a beat it takes torque away by itself.

    That process shares the socket of the bus, so that it needs nothing when it has to act: no
    memory, no file, no library. It is for buses whose socket takes frames in the kernel's layout
    (`Channel.has_shared_socket`).

    Args:
        bus: the bus.
        frames: those that take torque away, in their order.
        silence_s: how long the heart may stand still [s].

    Raises:
        BusError: the process does not start.
    """
    heart_file = os.memfd_create("wamctl-heart")
    try:
        os.ftruncate(heart_file, HEART_BYTES)
        descriptors = [heart_file, bus.fileno()]
        child = ChildProcess(
            "wamctl.safety.watchdog_process", [str(d) for d in descriptors], descriptors
        )
        packed = [build_can_frame(frame).hex() for frame in frames]
        child.tell(json.dumps({"frames": packed, "silence_s": silence_s}), _START_S)
        if child.answer(_START_S) != READY:
            raise BusError(f"The watchdog process did not start ({child.end(_END_S)}).")
        heart = WatchedHeart(heart_file)
        try:
            yield heart
        finally:
            child.tell(DONE, _END_S)
            child.end(_END_S)
    finally:
        os.close(heart_file)
