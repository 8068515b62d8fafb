"""What is new in the ring, read without taking it out."""

from dataclasses import dataclass

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.telemetry import ring as shared

_SEEN_AT_MOST = shared.SLOTS // 4
"""Older records may be overwritten while they are read."""


@dataclass(frozen=True)
class Record:
    """A record of the ring.

    Attributes:
        stamp_ns: its stamp [ns].
        values: its numbers.
    """

    stamp_ns: int
    values: Array


class Reader:
    """Looks for new records.

    Args:
        ring: the ring, which stays as it is.
    """

    def __init__(self, ring: shared.Ring) -> None:
        self._ring = ring
        self._read = 0

    def new(self) -> dict[int, list[Record]]:
        """By kind the records since the last call, in order; kinds without any are missing."""
        produced = int(self._ring.header[shared.PRODUCED])
        first = max(self._read, produced - _SEEN_AT_MOST)
        slots = np.arange(first, produced) % shared.SLOTS
        self._read = produced
        found: dict[int, list[Record]] = {}
        for slot in slots.tolist():
            record = Record(int(self._ring.stamps_ns[slot]), self._ring.values[slot].copy())
            found.setdefault(int(self._ring.kinds[slot]), []).append(record)
        return found

    def first_stamp_ns(self) -> int | None:
        """Stamp of the log's first record [ns]; None where there is none, or it is gone."""
        produced = int(self._ring.header[shared.PRODUCED])
        return int(self._ring.stamps_ns[0]) if 0 < produced < shared.SLOTS else None
