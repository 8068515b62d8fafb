"""A joint message with slots: everything but a stamp and arrays of numbers is encoded once."""

from collections.abc import Sequence

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.ros2.cdr import Fields, Kind, encode, layout

_NS = 1_000_000_000


class Template:
    """Messages of one topic and form.

    Args:
        fields: of the message.
        names: joint names, where the message has them.
        lengths: number of entries of each array.
    """

    def __init__(self, fields: Fields, names: Sequence[str], lengths: Sequence[int]) -> None:
        numbers = iter(lengths)
        blank: dict[Kind, object] = {"string": "", "strings": list(names)}
        message = encode(
            (kind, [0.0] * next(numbers) if kind == "doubles" else blank.get(kind, 0))
            for _, kind in fields
        )
        slots = layout(message, fields).slots
        self._message = bytearray(message)
        self._sec, self._nanosec = slots["sec"], slots["nanosec"]
        self._arrays = [slots[name] for name, kind in fields if kind == "doubles"]

    def filled(self, time_ns: int, arrays: Sequence[Array | None]) -> bytes:
        """The message with this time [ns] and these arrays."""
        seconds, nanoseconds = divmod(time_ns, _NS)
        message = self._message
        message[self._sec] = seconds.to_bytes(4, "little", signed=True)
        message[self._nanosec] = nanoseconds.to_bytes(4, "little")
        for slot, array in zip(self._arrays, arrays, strict=False):
            if array is not None:
                message[slot] = np.asarray(array, dtype="<f8").tobytes()
        return bytes(message)
