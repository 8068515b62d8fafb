"""A CAN frame, and its form in the kernel's `struct can_frame` and `struct canfd_frame`."""

import struct
from collections.abc import Iterable
from typing import NamedTuple

EXTENDED = 0x8000_0000
REMOTE = 0x4000_0000
ERROR = 0x2000_0000
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
"""Lengths of CAN FD data, by their data length code."""

_CLASSIC = struct.Struct("=IB3x8s")
_FD = struct.Struct("=IBB2x64s")
_FD_FLAGS = 0x04 | 0x01  # a CAN FD frame, with bit-rate switch
_HEAD = struct.Struct("=IBB2x")  # of both kinds: identifier, length of the data, flags
_SENT = struct.Struct("=q")


class Frame(NamedTuple):
    """One frame; a NamedTuple, since the bus makes ten of them in every cycle.

    Attributes:
        can_id: identifier, with the kernel's flag bits 29 to 31 (`ERROR`, `REMOTE`, `EXTENDED`).
        data: payload, up to 8 bytes, or up to 64 with `fd`.
        fd: a CAN FD frame with bit-rate switch.
    """

    can_id: int
    data: bytes = b""
    fd: bool = False


def carried_length(length: int, fd: bool) -> int:
    """Bytes that a frame carries for so many bytes of data; long CAN FD frames come in steps."""
    return next(n for n in FD_LENGTHS if n >= length) if fd else length


def pack(frame: Frame) -> bytes:
    """The frame as the kernel lays it out: 16 bytes, or 72 for CAN FD."""
    if frame.fd:
        return _FD.pack(frame.can_id, len(frame.data), _FD_FLAGS, frame.data)
    return _CLASSIC.pack(frame.can_id, len(frame.data), frame.data)


def stamped(frame: Frame, sent_ns: int) -> bytes:
    """The packed frame with the instant of sending [ns, monotonic clock] behind it."""
    return pack(frame) + _SENT.pack(sent_ns)


def unstamp(packet: bytes) -> tuple[bytes, int | None]:
    """Inverse of `stamped`: the packed frame, and when it was sent; None where no stamp is."""
    if len(packet) in (_CLASSIC.size + _SENT.size, _FD.size + _SENT.size):
        return packet[: -_SENT.size], _SENT.unpack(packet[-_SENT.size :])[0]
    return packet, None


def bundle(frames: Iterable[Frame], settled: int = 0) -> bytes:
    """A packet for a program: how many of its frames are settled (see `SocketHub`), and frames."""
    return bytes([settled]) + b"".join(map(pack, frames))


def unbundle(packet: bytes) -> tuple[int, list[Frame]]:
    """Inverse of `bundle`."""
    frames, at = [], 1
    while at < len(packet):
        can_id, length, flags = _HEAD.unpack_from(packet, at)
        data_at, fd = at + _HEAD.size, flags == _FD_FLAGS
        frames.append(Frame(can_id, packet[data_at : data_at + length], fd))
        at += _FD.size if fd else _CLASSIC.size
    return packet[0], frames


def unpack(packet: bytes) -> Frame | None:
    """Inverse of `pack`; None for a packet of another size or with an impossible length."""
    if len(packet) == _CLASSIC.size:
        can_id, length, data = _CLASSIC.unpack(packet)
        return Frame(can_id, data[:length]) if length <= 8 else None
    if len(packet) == _FD.size:
        can_id, length, _, data = _FD.unpack(packet)
        return Frame(can_id, data[:length], True) if length <= 64 else None
    return None
