"""CDR, the encoding of ROS 2 messages: one message's layout, and many of equal layout as arrays.

A message is a flat row of fields, each aligned to its size, counted from the end of a header of
four bytes. Joint messages of one publisher differ only in stamps and numbers, so that a template
with slots writes them, and one look at the fixed bytes reads thousands at once.
"""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["byte", "int32", "uint32", "string", "strings", "doubles"]
Fields = tuple[tuple[str, Kind], ...]

HEADER = b"\x00\x01\x00\x00"
"""Plain CDR, little-endian."""

_STAMP: Fields = (("sec", "int32"), ("nanosec", "uint32"))
JOINT_STATE: Fields = (
    *_STAMP,
    ("frame_id", "string"),
    ("name", "strings"),
    ("position", "doubles"),
    ("velocity", "doubles"),
    ("effort", "doubles"),
)
"""sensor_msgs/msg/JointState."""
TRAJECTORY_POINT: Fields = (
    ("positions", "doubles"),
    ("velocities", "doubles"),
    ("accelerations", "doubles"),
    ("effort", "doubles"),
    *_STAMP,
)
"""trajectory_msgs/msg/JointTrajectoryPoint."""

_NUMBERS = {"byte": ("<B", 1), "int32": ("<i", 4), "uint32": ("<I", 4)}


@dataclass(frozen=True)
class Layout:
    """Where the changing bytes of a message lie.

    Attributes:
        slots: byte range of each stamp part and array of numbers.
        texts: the strings of each text field.
        fixed: shape (bytes,), true for the bytes that every message of this layout shares.
    """

    slots: dict[str, slice]
    texts: dict[str, tuple[str, ...]]
    fixed: NDArray[np.bool_]


def encode(values: Iterable[tuple[Kind, object]]) -> bytes:
    """The message that holds these values one after the other."""
    out = bytearray(HEADER)
    for kind, value in values:
        match kind, value:
            case ("string", str(text)):
                _put_string(out, text)
            case ("strings", texts) if isinstance(texts, Sequence):
                _put_number(out, "<I", 4, len(texts))
                for text in texts:
                    _put_string(out, text)
            case ("doubles", numbers) if isinstance(numbers, Sequence):
                _put_number(out, "<I", 4, len(numbers))
                for number in numbers:
                    _put_number(out, "<d", 8, number)
            case _:
                _put_number(out, *_NUMBERS[kind], value)
    return bytes(out)


def _put_number(out: bytearray, form: str, size: int, value: object) -> None:
    out += b"\x00" * (-(len(out) - len(HEADER)) % size)
    out += struct.pack(form, value)


def _put_string(out: bytearray, text: str) -> None:
    data = text.encode() + b"\x00"
    _put_number(out, "<I", 4, len(data))
    out += data


def layout(message: bytes, fields: Fields) -> Layout:
    """The layout of one message.

    Raises:
        ValueError: not little-endian CDR of these fields.
    """
    if message[:4] != HEADER:
        raise ValueError("not plain little-endian CDR")
    walk = _Walk(message)
    slots: dict[str, slice] = {}
    texts: dict[str, tuple[str, ...]] = {}
    try:
        for name, kind in fields:
            match kind:
                case "string":
                    texts[name] = (walk.string(),)
                case "strings":
                    texts[name] = tuple(walk.string() for _ in range(walk.count()))
                case "doubles":
                    slots[name] = walk.slot(8, walk.count())
                case _:
                    slots[name] = walk.slot(_NUMBERS[kind][1], 1)
    except struct.error as error:
        raise ValueError("the message ends too early") from error
    if walk.position > len(message):
        raise ValueError("the message ends too early")
    return Layout(slots, texts, walk.fixed)


class _Walk:
    """A walk over one message, which notes the bytes that decide where everything lies."""

    def __init__(self, message: bytes) -> None:
        self.message = message
        self.position = len(HEADER)
        self.fixed = np.zeros(len(message), dtype=bool)
        self.fixed[: self.position] = True

    def slot(self, size: int, number: int) -> slice:
        if number:
            self.position += -(self.position - len(HEADER)) % size
        start = self.position
        self.position += size * number
        return slice(start, self.position)

    def count(self) -> int:
        where = self.slot(4, 1)
        self.fixed[where] = True
        return struct.unpack_from("<I", self.message, where.start)[0]

    def string(self) -> str:
        where = self.slot(1, self.count())
        self.fixed[where] = True
        return self.message[where].rstrip(b"\x00").decode()


def columns(messages: Sequence[bytes], fields: Fields) -> tuple[Layout, dict[str, NDArray]] | None:
    """The first message's layout, and the numbers of all messages, each of shape (S, entries).

    None when another message has another layout, so that they must be read one by one.

    Raises:
        ValueError: the first message is not little-endian CDR of these fields.
    """
    shape = layout(messages[0], fields)
    length = len(messages[0])
    if set(map(len, messages)) != {length}:
        return None
    table = np.frombuffer(b"".join(messages), dtype=np.uint8).reshape(len(messages), length)
    fixed = table[:, shape.fixed]
    if not np.array_equal(fixed, np.broadcast_to(fixed[0], fixed.shape)):
        return None
    kinds = {"sec": "<i4", "nanosec": "<u4"}
    return shape, {
        name: np.ascontiguousarray(table[:, slot]).view(kinds.get(name, "<f8"))
        for name, slot in shape.slots.items()
    }
