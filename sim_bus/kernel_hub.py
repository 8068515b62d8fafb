"""The kernel's CAN, whose frames come and leave in bursts: one call of the system for all of them.

A program that asks for each frame by itself needs several calls for each.
"""

import ctypes
import errno
import os
import socket
import struct
import time
from collections.abc import Iterator, Sequence

from sim_bus.errors import SimulatedBusError
from sim_bus.frame import LONGEST_BYTES, Frame, pack, unpack
from sim_bus.hub import Received
from sim_bus.look_out import Source

_SLOTS = 64
_MESSAGE = struct.Struct("@PIPNPNi0PI0P")  # struct mmsghdr
_ROOM_FOR_STAMP_AT, _LENGTH_AT = struct.calcsize("@PIPNP0N"), struct.calcsize("@PIPNPNi0P")
_SIZE, _COUNT = struct.Struct("@N"), struct.Struct("@I")
_VECTOR = struct.Struct("@PN")  # struct iovec
_STAMP = struct.Struct("@Niill")  # struct cmsghdr, then seconds and nanoseconds
_SO_TIMESTAMPNS = 35
_COMPARED_EVERY = 100  # bursts, after which the wall clock is compared again: it may be set

_kernel = ctypes.CDLL(None, use_errno=True)


class KernelHub:
    """A CAN interface of the kernel, which carries the other programs' frames by itself.

    Raises:
        SimulatedBusError: there is none of this name.
    """

    def __init__(self, interface: str, fd: bool = False) -> None:
        self._name = f"socketcan:{interface}"
        self._incoming, self._outgoing = _Slots(stamped=True), _Slots(stamped=False)
        self._leaving: list[bytes] = []
        self._bursts = self._ahead_ns = 0
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
        frames: list[Received] = []
        count = _SLOTS if readable else 0
        while count == _SLOTS:
            count = self._call("recvmmsg", self._incoming.at, _SLOTS, None)
            if self._bursts % _COMPARED_EVERY == 0:
                self._ahead_ns = time.monotonic_ns() - time.time_ns()
            self._bursts += 1
            frames += self._taken(count)
        return frames

    def _taken(self, count: int) -> Iterator[Received]:
        for slot in range(count):
            packet, stamp_ns = self._incoming.take(slot)
            frame = unpack(packet)
            if frame is not None:
                yield Received(frame, self, stamp_ns + self._ahead_ns)

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        """Send devices' frames, by `flush`; those of other programs are on the bus already."""
        if sender is not self:
            self._leaving += map(pack, frames)

    def settle(self, sender: object, time_ns: int) -> None:
        """Nothing: a CAN bus has no word for it."""

    def flush(self) -> None:
        """Send what was delivered.

        Raises:
            SimulatedBusError: the interface takes no more frames.
        """
        while self._leaving:
            packets = self._leaving[:_SLOTS]
            for slot, packet in enumerate(packets):
                self._outgoing.put(slot, packet)
            sent = self._call("sendmmsg", self._outgoing.at, len(packets))
            if not sent:
                raise SimulatedBusError(f"sim-bus cannot send on {self._name}: its queue is full.")
            del self._leaving[:sent]

    def close(self) -> None:
        """Leave the bus."""
        self._socket.close()

    def _call(self, name: str, at: int, count: int, *more: None) -> int:
        """How many messages the kernel has dealt with."""
        call = getattr(_kernel, name)
        dealt_with = call(
            self._socket.fileno(), ctypes.c_void_p(at), count, socket.MSG_DONTWAIT, *more
        )
        if dealt_with >= 0:
            return dealt_with
        if (number := ctypes.get_errno()) != errno.EAGAIN:
            raise SimulatedBusError(f"sim-bus lost the bus {self._name} ({os.strerror(number)}).")
        return 0


def _opened(interface: str, fd: bool) -> socket.socket:
    found = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    try:
        found.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, int(fd))
        found.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        found.bind((interface,))
    except OSError:
        found.close()
        raise
    return found


class _Slots:
    """A list of messages as the kernel wants it, each with places for a frame and its stamp.

    Attributes:
        at: address of the list.
    """

    def __init__(self, stamped: bool) -> None:
        sizes = (_MESSAGE.size, _VECTOR.size, LONGEST_BYTES, _STAMP.size)
        memory = [bytearray(_SLOTS * size) for size in sizes]
        self._messages, self._vectors, self._frames, self._stamps = memory
        self._pinned = [(ctypes.c_char * len(part)).from_buffer(part) for part in memory]
        self.at, vectors_at, frames_at, stamps_at = map(ctypes.addressof, self._pinned)
        for slot in range(_SLOTS):
            frame_at, stamp_at = frames_at + slot * LONGEST_BYTES, stamps_at + slot * _STAMP.size
            stamp = (stamp_at, _STAMP.size) if stamped else (0, 0)
            vector_at = vectors_at + slot * _VECTOR.size
            _VECTOR.pack_into(self._vectors, slot * _VECTOR.size, frame_at, LONGEST_BYTES)
            _MESSAGE.pack_into(
                self._messages, slot * _MESSAGE.size, 0, 0, vector_at, 1, *stamp, 0, 0
            )

    def put(self, slot: int, packet: bytes) -> None:
        """A packet to be sent."""
        at = slot * LONGEST_BYTES
        self._frames[at : at + len(packet)] = packet
        _SIZE.pack_into(self._vectors, (slot + 1) * _VECTOR.size - _SIZE.size, len(packet))

    def take(self, slot: int) -> tuple[bytes, int]:
        """A packet that has come, and when the kernel took it, by its wall clock [ns]."""
        message_at, at = slot * _MESSAGE.size, slot * LONGEST_BYTES
        (length,) = _COUNT.unpack_from(self._messages, message_at + _LENGTH_AT)
        _SIZE.pack_into(self._messages, message_at + _ROOM_FOR_STAMP_AT, _STAMP.size)
        *_, seconds, nanoseconds = _STAMP.unpack_from(self._stamps, slot * _STAMP.size)
        return bytes(self._frames[at : at + length]), seconds * 1_000_000_000 + nanoseconds
