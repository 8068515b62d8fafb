"""Frames of the classic Puck protocol: identifiers, GET and SET, packed positions and torques.

Sources: WAM user's manual D1001 AH.00, pp. 46-48; libbarrett `puck.h`, `motor_puck-inl.h`.
"""

from collections.abc import Sequence
from typing import NamedTuple

from wamctl.puck.enumerations import HOST
from wamctl.puck.errors import FrameError

GROUP_BIT = 0x400
SET_BIT = 0x80
NODE_MAX = 31
TORQUE_MAX = 8191


class Address(NamedTuple):
    """Who sends to whom; `receiver` is a node, or a group where `to_group` says so."""

    sender: int
    receiver: int
    to_group: bool


def identifier(address: Address) -> int:
    """The 11-bit identifier `G FFFFF TTTTT`.

    Raises:
        FrameError: a sender or receiver beyond five bits.
    """
    sender, receiver, to_group = address
    for what, node in (("sender", sender), ("receiver", receiver)):
        if not 0 <= node <= NODE_MAX:
            raise FrameError(f"The {what} {node} of a Puck frame is outside 0 to {NODE_MAX}.")
    return GROUP_BIT * to_group | sender << 5 | receiver


def address(identifier: int) -> Address:
    """Inverse of `identifier`.

    Raises:
        FrameError: an identifier beyond eleven bits.
    """
    if not 0 <= identifier <= 0x7FF:
        raise FrameError(f"The identifier {identifier:#x} does not fit into 11 bits.")
    return Address(identifier >> 5 & NODE_MAX, identifier & NODE_MAX, bool(identifier & GROUP_BIT))


def to_node(node: int) -> int:
    """Identifier of a frame from the host to one Puck."""
    return identifier(Address(HOST, node, to_group=False))


def to_group(group: int, sender: int = HOST) -> int:
    """Identifier of a frame to a group: from the host, or a Puck's reply."""
    return identifier(Address(sender, group, to_group=True))


def encode_get(property_id: int) -> bytes:
    """Data of a question for a property.

    Raises:
        FrameError: a property id beyond seven bits.
    """
    return bytes((_seven_bits(property_id),))


def encode_set(property_id: int, value: int, width: int = 4) -> bytes:
    """Data that set a property.

    Args:
        property_id: number in the Puck's firmware.
        value: signed value.
        width: bytes of the value, 2 or 4; libbarrett and OWD always send 4, whatever the property.

    Raises:
        FrameError: a property id beyond seven bits, or a value that does not fit.
    """
    bound = 1 << (8 * width - 1)
    if not -bound <= value < bound:
        raise FrameError(
            f"The value {value} for property {property_id} is outside {-bound} to {bound - 1}."
        )
    head = bytes((SET_BIT | _seven_bits(property_id), 0))
    return head + value.to_bytes(width, "little", signed=True)


def decode_reply(property_id: int, data: bytes) -> int:
    """Signed value in the answer to `encode_get`, any property but the position.

    Raises:
        FrameError: a wrong length, another property, or an alignment byte that is not zero.
    """
    if len(data) not in (4, 6):
        raise FrameError(
            f"The answer {data.hex(' ')} has {len(data)} bytes; a property has 4 or 6."
        )
    if data[0] != SET_BIT | property_id:
        raise FrameError(
            f"The answer {data.hex(' ')} is not for property {property_id}, which was asked for."
        )
    if data[1] != 0:
        raise FrameError(f"The answer {data.hex(' ')} has {data[1]:#04x} where a zero must be.")
    return int.from_bytes(data[2:], "little", signed=True)


def decode_positions(data: bytes) -> tuple[int, ...]:
    """Counts of the motor [counts], and of the joint encoder where the Puck has one.

    Raises:
        FrameError: a length that is neither 3 nor 6, or one of the unused top bits set.
    """
    if len(data) not in (3, 6):
        raise FrameError(
            f"The position {data.hex(' ')} has {len(data)} bytes; 3 or 6 are possible."
        )
    return tuple(decode_position(data[i : i + 3]) for i in range(0, len(data), 3))


def decode_position(three: bytes | bytearray) -> int:
    """Counts of one packed position.

    Raises:
        FrameError: one of the unused top bits is set.
    """
    if three[0] & 0xC0:
        raise FrameError(f"The position {three.hex(' ')} has its unused top bits set.")
    return _signed(int.from_bytes(three, "big"), 22)


def encode_torques(property_id: int, torques: Sequence[int]) -> bytes:
    """Data of a packed torque frame: four values of 14 bits, most significant bit first.

    Args:
        property_id: number of T in the Pucks' firmware.
        torques: at most four values in Puck units, in the order of PIDX; missing ones are zero.
            Values beyond +-8191 are saturated.

    Raises:
        FrameError: more than four values.
    """
    if len(torques) > 4:
        raise FrameError(f"A torque frame holds 4 values, not {len(torques)}.")
    word = SET_BIT | _seven_bits(property_id)
    for torque in (*torques, 0, 0, 0, 0)[:4]:
        word = word << 14 | max(-TORQUE_MAX, min(TORQUE_MAX, torque)) & 0x3FFF
    return word.to_bytes(8, "big")


def _signed(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> (bits - 1) else value


def _seven_bits(property_id: int) -> int:
    if not 0 <= property_id < SET_BIT:
        raise FrameError(f"The property id {property_id} is outside 0 to {SET_BIT - 1}.")
    return property_id
