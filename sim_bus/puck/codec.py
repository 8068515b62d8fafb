"""The words of the classic Puck protocol as a Puck reads and writes them (manual, pp. 46-48)."""

import struct
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, lru_cache

from sim_bus.can_bus.frame import Frame

POSITION_BITS = 22
TORQUE_BITS = 14

_REPLY = {2: struct.Struct("<BBh"), 4: struct.Struct("<BBi")}
_POSITIONS_GROUP = 3
_ANSWERS_GROUP = 6


class Stat(IntEnum):
    """STAT."""

    RESET = 0
    ERR = 1
    READY = 2


class Mode(IntEnum):
    """MODE of a motor Puck, as far as the simulated one knows it."""

    IDLE = 0
    TORQUE = 2


class SafetyState(IntEnum):
    """MODE of the safety Puck."""

    ESTOP = 0
    IDLE = 1
    ACTIVE = 2


@dataclass(frozen=True)
class DecodedFrame:
    """A frame, taken apart.

    Attributes:
        sender: node that sent it; 0 is the host.
        group: receiving group, or None for a directed frame.
        node: receiving node, or None for a group frame.
        property_id: lower seven bits of the first byte.
        is_set: top bit of the first byte.
        data: all bytes.
    """

    sender: int
    group: int | None
    node: int | None
    property_id: int
    is_set: bool
    data: bytes

    @property
    def value(self) -> int | None:
        """Value of a SET, sign-extended; None unless it is well formed."""
        if not self.is_set or len(self.data) not in (4, 6) or self.data[1]:
            return None
        return int.from_bytes(self.data[2:], "little", signed=True)

    @cached_property
    def torques(self) -> tuple[int, int, int, int] | None:
        """Packed torques; None unless the frame has eight bytes and is a SET."""
        if len(self.data) != 8 or not self.is_set:
            return None
        packed = int.from_bytes(self.data[1:], "big")
        a, b, c, d = (_fold(packed >> k, TORQUE_BITS) for k in (42, 28, 14, 0))
        return a, b, c, d

    @property
    def position(self) -> int | None:
        """Packed position of a motor; None for frames that are not one."""
        if self.group != _POSITIONS_GROUP or len(self.data) not in (3, 6) or self.data[0] & 0xC0:
            return None
        return _fold(int.from_bytes(self.data[:3], "big"), POSITION_BITS)


@lru_cache(maxsize=8)  # many nodes hear the same frame
def decode(frame: Frame) -> DecodedFrame | None:
    """A frame taken apart; None for what Pucks do not listen to (extended, remote, empty)."""
    if frame.can_id > 0x7FF or not frame.data:
        return None
    sender, receiver, grouped = frame.can_id >> 5 & 31, frame.can_id & 31, frame.can_id & 0x400
    first = frame.data[0]
    return DecodedFrame(
        sender,
        receiver if grouped else None,
        None if grouped else receiver,
        first & 0x7F,
        first > 0x7F,
        frame.data,
    )


def answer(sender: int, property_id: int, value: int, width: int) -> Frame:
    """A property's value, 2 or 4 bytes wide, to the host's group for answers."""
    data = _REPLY[width].pack(property_id | 0x80, 0, _fold(value, 8 * width))
    return Frame(0x400 | sender << 5 | _ANSWERS_GROUP, data)


def position_answer(sender: int, motor: int, joint: int | None) -> Frame:
    """Position of the motor, and of its joint encoder if there is one, to the host's group."""
    data = _packed(motor) + (b"" if joint is None else _packed(joint))
    return Frame(0x400 | sender << 5 | _POSITIONS_GROUP, data)


def mode_broadcast(sender: int, mode_id: int, mode: Mode) -> Frame:
    """MODE for all actuators, as the safety module sends it (identifier 0x540 for node 10).

    The content of these frames is not documented; a SET in the ordinary form is an assumption.
    """
    return Frame(0x400 | sender << 5, bytes([0x80 | mode_id, 0, mode, 0]))


def _packed(counts: int) -> bytes:
    return (counts % (1 << POSITION_BITS)).to_bytes(3, "big")


def _fold(value: int, bits: int) -> int:
    """The lowest bits of a value as a signed number."""
    half = 1 << bits - 1
    return (value + half) % (2 * half) - half
