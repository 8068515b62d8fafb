"""The kernel's CAN (SocketCAN), without a library between: each frame is one call of the system."""

import os
import socket
import struct
import time
from collections.abc import Iterator, Sequence

from sim_bus.can_bus.frame import LONGEST_BYTES, Frame, pack, unpack
from sim_bus.can_bus.hub import Received
from sim_bus.can_bus.waiting import Source
from sim_bus.errors import SimulatedBusError

_SO_TIMESTAMPNS = 35
_STAMP = struct.Struct("@ll")  # seconds and nanoseconds of the wall clock
_ROOM_FOR_STAMP = socket.CMSG_SPACE(_STAMP.size)
_COMPARED_EVERY = 100  # calls, after which the wall clock is compared again: it may be set


class KernelHub:
    """A CAN interface of the kernel, which carries the other programs' frames by itself.

    Raises:
        SimulatedBusError: there is none of this name.
    """

    gathers = True

    def __init__(self, interface: str, fd: bool = False) -> None:
        self._name = f"socketcan:{interface}"
        self._leaving: list[Frame] = []
        self._calls = self._ahead_ns = 0
        try:
            self._socket = _opened(interface, fd)
        except OSError as error:
            raise SimulatedBusError(
                f"sim-bus cannot open the bus {self._name} ({error}): "
                "`--bus simbus:PATH` needs no CAN interface."
            ) from error

    def sources(self) -> Sequence[Source]:
        """The interface."""
        return [self._socket]

    def receive(self, readable: Sequence[Source]) -> list[Received]:
        """Frames of others.

        Raises:
            SimulatedBusError: the interface is down or gone.
        """
        if not readable:
            return []
        if self._calls % _COMPARED_EVERY == 0:
            self._ahead_ns = time.monotonic_ns() - time.time_ns()
        self._calls += 1
        try:
            return list(self._waiting())
        except OSError as error:
            raise self._lost(error) from error

    def _waiting(self) -> Iterator[Received]:
        while True:
            try:
                packet, notes, _, _ = self._socket.recvmsg(LONGEST_BYTES, _ROOM_FOR_STAMP)
            except BlockingIOError:
                return
            frame = unpack(packet)
            if frame is not None:
                ((_, _, stamp),) = notes
                seconds, nanoseconds = _STAMP.unpack(stamp)
                sent_ns = seconds * 1_000_000_000 + nanoseconds + self._ahead_ns
                yield Received(frame, self, sent_ns)

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        """Send devices' frames, by `flush`; those of other programs are on the bus already."""
        if sender is not self:
            self._leaving += frames

    def settle(self, sender: object, time_ns: int) -> None:
        """Nothing: a CAN bus has no word for it."""

    def flush(self) -> None:
        """Send what was delivered.

        Raises:
            SimulatedBusError: the interface takes no more frames.
        """
        try:
            for frame in self._leaving:
                self._socket.send(pack(frame))
        except OSError as error:
            raise self._lost(error) from error
        finally:
            self._leaving.clear()

    def _lost(self, error: OSError) -> SimulatedBusError:
        reason = os.strerror(error.errno) if error.errno else str(error)
        return SimulatedBusError(f"sim-bus lost the bus {self._name} ({reason}).")

    def close(self) -> None:
        """Leave the bus."""
        self._socket.close()


def _opened(interface: str, fd: bool) -> socket.socket:
    found = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    try:
        found.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, int(fd))
        found.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        found.setblocking(False)
        found.bind((interface,))
    except OSError:
        found.close()
        raise
    return found
