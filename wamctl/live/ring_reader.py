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
    """Looks for the newest record of each kind.

    Args:
        ring: the ring, which stays as it is.
    """

    def __init__(self, ring: shared.Ring) -> None:
        self._ring = ring
        self._read = 0

    def newest(self) -> dict[int, Record]:
        """By kind the newest record since the last call; kinds without any are missing."""
        produced = int(self._ring.header[shared.PRODUCED])
        first = max(self._read, produced - _SEEN_AT_MOST)
        slots = np.arange(first, produced) % shared.SLOTS
        self._read = produced
        found = {}
        for kind in (shared.CYCLE, shared.STATUS):
            of_kind = slots[self._ring.kinds[slots] == kind]
            if len(of_kind):
                slot = of_kind[-1]
                stamp = int(self._ring.stamps_ns[slot])
                found[kind] = Record(stamp, self._ring.values[slot].copy())
        return found

    def first_stamp_ns(self) -> int | None:
        """Stamp of the log's first record [ns]; None where there is none, or it is gone."""
        produced = int(self._ring.header[shared.PRODUCED])
        return int(self._ring.stamps_ns[0]) if 0 < produced < shared.SLOTS else None
