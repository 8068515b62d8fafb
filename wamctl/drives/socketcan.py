"""A SocketCAN bus that takes and gives frames in bursts: one call of the system for all of them.

python-can's own asks the kernel for leave before each frame and reads the clock around it: six
calls a frame sent, three a frame received.
"""

import ctypes
import errno
import os
import socket
import struct
from collections import deque
from collections.abc import Sequence
from typing import Any, NoReturn

import can
from can.interfaces.socketcan import SocketcanBus, constants
from can.interfaces.socketcan.socketcan import build_can_frame, dissect_can_frame

_ROOM = 64  # frames in one burst
_FRAME_BYTES = 72  # of a CAN FD frame, the longer kind
_STAMP = struct.Struct("@Niill")  # a control message: its length, level and type, then s and ns
_EXTENDED, _REMOTE, _ERROR = 0x8000_0000, 0x4000_0000, 0x2000_0000
_POLL_IN = 1

_system = ctypes.CDLL(None, use_errno=True)


class _Part(ctypes.Structure):
    """`struct iovec`."""

    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _Header(ctypes.Structure):
    """`struct msghdr`."""

    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("parts", ctypes.POINTER(_Part)),
        ("part_count", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Entry(ctypes.Structure):
    """`struct mmsghdr`."""

    _fields_ = (("header", _Header), ("length", ctypes.c_uint))


class _Waited(ctypes.Structure):
    """`struct pollfd`."""

    _fields_ = (("descriptor", ctypes.c_int), ("wanted", ctypes.c_short), ("got", ctypes.c_short))


class _Duration(ctypes.Structure):
    """`struct timespec`."""

    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class _Burst:
    """Room for the frames of one call.

    Attributes:
        entries: the kernel's list of them.
        frames: where each of them lies, and its length in `parts`.
        stamps: where the kernel tells when it took each of them.
    """

    def __init__(self) -> None:
        self.entries = (_Entry * _ROOM)()
        self.parts = (_Part * _ROOM)()
        self.frames = [ctypes.create_string_buffer(_FRAME_BYTES) for _ in range(_ROOM)]
        self.stamps = [ctypes.create_string_buffer(_STAMP.size) for _ in range(_ROOM)]
        for entry, part, frame in zip(self.entries, self.parts, self.frames, strict=True):
            part.base, part.length = ctypes.addressof(frame), _FRAME_BYTES
            entry.header.parts, entry.header.part_count = ctypes.pointer(part), 1

    def ask_for_stamps(self, count: int) -> None:
        """Room for the stamps of the first frames, which the kernel makes smaller each time."""
        for k in range(count):
            header = self.entries[k].header
            header.control, header.control_length = ctypes.addressof(self.stamps[k]), _STAMP.size


class BurstBus(SocketcanBus):
    """python-can's SocketCAN bus, with all waiting frames received, and many sent, by one call.

    `recv` and `send` may run in two threads, but not each of them in two.

    Args:
        channel: name of the interface.
        kwargs: as for python-can's.
    """

    def __init__(self, channel: str, **kwargs: Any) -> None:
        self._arrived: deque[can.Message] = deque()
        self._incoming, self._outgoing = _Burst(), _Burst()
        self._incoming.ask_for_stamps(_ROOM)
        super().__init__(channel, **kwargs)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame; None where none comes within the time limit [s].

        Raises:
            can.CanOperationError: the interface is down or gone.
        """
        if self.filters and not self._is_filtered:
            return super().recv(timeout)
        return self._recv_internal(timeout)[0]

    @property
    def has_arrived(self) -> bool:
        """Whether the next frame is here already, so that `recv` asks neither kernel nor clock."""
        return bool(self._arrived)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Give a frame to the interface.

        Raises:
            can.CanOperationError: it does not take it.
        """
        if timeout:
            super().send(msg, timeout)
        else:
            self.send_all((msg,))

    def send_all(self, frames: Sequence[can.Message]) -> None:
        """Give frames to the interface in their order.

        Raises:
            can.CanOperationError: it does not take one of them; those before it have been given.
        """
        for first in range(0, len(frames), _ROOM):
            packed = [build_can_frame(frame) for frame in frames[first : first + _ROOM]]
            for k, data in enumerate(packed):
                ctypes.memmove(self._outgoing.frames[k], data, len(data))
                self._outgoing.parts[k].length = len(data)
            self._give(len(packed))

    def _give(self, count: int) -> None:
        """Send so many frames; the kernel tells why it stopped when it is asked to go on."""
        given = 0
        while given < count:
            entry = ctypes.byref(self._outgoing.entries, given * ctypes.sizeof(_Entry))
            done = _system.sendmmsg(self.socket.fileno(), entry, count - given, socket.MSG_DONTWAIT)
            if done < 0:
                _fail("transmit")
            given += done

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._arrived and (timeout == 0 or self._is_readable(timeout)):
            self._take()
        return self._arrived.popleft() if self._arrived else None, self._is_filtered

    def _is_readable(self, timeout: float | None) -> bool:
        """Whether a frame, or an error, comes within the time limit [s]."""
        waited = _Waited(self.socket.fileno(), _POLL_IN, 0)
        limit = None if timeout is None else ctypes.byref(_duration(timeout))
        while (found := _system.ppoll(ctypes.byref(waited), 1, limit, None)) < 0:
            if ctypes.get_errno() != errno.EINTR:
                _fail("receive")
        return found > 0

    def _take(self) -> None:
        """All frames that have come."""
        burst = self._incoming
        count = _system.recvmmsg(
            self.socket.fileno(), burst.entries, _ROOM, socket.MSG_DONTWAIT, None
        )
        if count < 0:
            if ctypes.get_errno() == errno.EAGAIN:
                return
            _fail("receive")
        for k in range(count):
            entry = burst.entries[k]
            stamp_s = _stamp_s(burst.stamps[k], entry.header.control_length)
            frame = burst.frames[k].raw[: entry.length]
            is_own = bool(entry.header.flags & socket.MSG_DONTROUTE)
            self._arrived.append(_message(frame, stamp_s, self.channel, not is_own))
        burst.ask_for_stamps(count)


def _message(frame: bytes, stamp_s: float, channel: str, is_rx: bool) -> can.Message:
    can_id, length, flags, data = dissect_can_frame(frame)
    is_extended = bool(can_id & _EXTENDED)
    return can.Message(
        stamp_s,
        can_id & (0x1FFF_FFFF if is_extended else 0x7FF),
        is_extended,
        bool(can_id & _REMOTE),
        bool(can_id & _ERROR),
        channel,
        length,
        data,
        len(frame) == _FRAME_BYTES,
        is_rx,
        bool(flags & constants.CANFD_BRS),
        bool(flags & constants.CANFD_ESI),
    )


def _stamp_s(stamp: "ctypes.Array[ctypes.c_char]", length: int) -> float:
    """When the kernel took a frame, by the clock of `time.time` [s]."""
    _, level, kind, seconds, nanoseconds = _STAMP.unpack_from(stamp)
    if length < _STAMP.size or (level, kind) != (socket.SOL_SOCKET, constants.SO_TIMESTAMPNS):
        raise can.CanOperationError("Failed to receive: the kernel has not stamped a frame")
    return seconds + nanoseconds * 1e-9


def _duration(seconds: float) -> _Duration:
    whole = int(seconds)
    return _Duration(whole, int((seconds - whole) * 1e9))


def _fail(what: str) -> NoReturn:
    number = ctypes.get_errno()
    if number == errno.EAGAIN:
        raise can.CanOperationError("Transmit buffer full", number)
    raise can.CanOperationError(f"Failed to {what}: {os.strerror(number)}", number)
