"""A CAN frame, and its form in the kernel's `struct can_frame` and `struct canfd_frame`."""

import struct
from typing import NamedTuple

EXTENDED = 0x8000_0000
REMOTE = 0x4000_0000
ERROR = 0x2000_0000
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
"""Lengths of CAN FD data, by their data length code."""

_CLASSIC = struct.Struct("=IB3x8s")
_FD = struct.Struct("=IBB2x64s")
LONGEST_BYTES = _FD.size
"""Of a packed frame."""
_FD_FLAGS = 0x04 | 0x01  # a CAN FD frame, with bit-rate switch
_HEAD = struct.Struct("=IBB2x")  # of both kinds: identifier, length of the data, flags
_SENT = struct.Struct("=q")
_BUNDLE = struct.Struct("=Bq")  # settled frames, instant [ns]


class Frame(NamedTuple):
    """One frame; a NamedTuple, since the bus makes ten of them in every cycle.

    Attributes:
        can_id: identifier, with the kernel's flag bits 29 to 31 (`ERROR`, `REMOTE`, `EXTENDED`).
        data: payload, up to 8 bytes, or up to 64 with `fd`.
        fd: a CAN FD frame with bit-rate switch.
        passed_ns: when its last bit passed, where that was before it is delivered; 0: just then.
    """

    can_id: int
    data: bytes = b""
    fd: bool = False
    passed_ns: int = 0


def carried_length(length: int, fd: bool) -> int:
    """Bytes that a frame carries for a length of data; long CAN FD frames come in steps."""
    return next(n for n in FD_LENGTHS if n >= length) if fd else length


def pack(frame: Frame) -> bytes:
    """The frame as the kernel lays it out: 16 bytes, or 72 for CAN FD."""
    if frame.fd:
        return _FD.pack(frame.can_id, len(frame.data), _FD_FLAGS, frame.data)
    return _CLASSIC.pack(frame.can_id, len(frame.data), frame.data)


def stamped(frame: Frame, time_ns: int) -> bytes:
    """The packed frame with an instant [ns] behind it."""
    return pack(frame) + _SENT.pack(time_ns)


def unstamp(packet: bytes) -> tuple[bytes, int | None]:
    """Inverse of `stamped`: the packed frame and the instant; None where no stamp is."""
    if len(packet) in (_CLASSIC.size + _SENT.size, _FD.size + _SENT.size):
        return packet[: -_SENT.size], _SENT.unpack(packet[-_SENT.size :])[0]
    return packet, None


class Bundle(NamedTuple):
    """Content of one packet to a program.

    Attributes:
        settled: how many of its own frames are settled (see `SocketHub`).
        now_ns: the bus's time as the packet leaves [ns].
        frames: frames from the bus.
        passed_ns: when the last bit of each of them had passed, by the same clock [ns].
    """

    settled: int
    now_ns: int
    frames: list[Frame]
    passed_ns: list[int]


def bundle(parts: Bundle) -> bytes:
    """A packet for a program."""
    head = _BUNDLE.pack(parts.settled, parts.now_ns)
    pairs = zip(parts.frames, parts.passed_ns, strict=True)
    return head + b"".join([stamped(frame, passed_ns) for frame, passed_ns in pairs])


def unbundle(packet: bytes) -> Bundle:
    """Inverse of `bundle`."""
    frames, passed_ns, at = [], [], _BUNDLE.size
    while at < len(packet):
        can_id, length, flags = _HEAD.unpack_from(packet, at)
        data_at, fd = at + _HEAD.size, flags == _FD_FLAGS
        frames.append(Frame(can_id, packet[data_at : data_at + length], fd))
        at += _FD.size if fd else _CLASSIC.size
        passed_ns += _SENT.unpack_from(packet, at)
        at += _SENT.size
    settled, now_ns = _BUNDLE.unpack_from(packet)
    return Bundle(settled, now_ns, frames, passed_ns)


def unpack(packet: bytes) -> Frame | None:
    """Inverse of `pack`; None for a packet of another size or with an impossible length."""
    if len(packet) == _CLASSIC.size:
        can_id, length, data = _CLASSIC.unpack(packet)
        return Frame(can_id, data[:length]) if length <= 8 else None
    if len(packet) == _FD.size:
        can_id, length, _, data = _FD.unpack(packet)
        return Frame(can_id, data[:length], True) if length <= 64 else None
    return None
