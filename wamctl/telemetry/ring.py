"""Shared memory between the loop and the processes that record and show what it does."""

import mmap
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wamctl.telemetry.status import NUMBERS

SLOTS = 4096
"""Records that fit: eight seconds at 500 Hz, longer than any disk that works pauses."""

PRODUCED, CONSUMED, PHASE, DONE, TOTAL, WRITER_FAILED, ROWS_WRITTEN = range(7)
"""Places in the header."""
CYCLE, STATUS = 0, 1
"""Kinds of record."""

COLUMNS = 6
"""Vectors in the record of a cycle: q, qd, q_ref, qd_ref, qdd_ref, tau."""
_HEADER = 64


@dataclass(frozen=True)
class Ring:
    """Records of fixed size for one writer and one reader; the counts tell which are valid.

    Attributes:
        header: int64 counts and flags, at the places above.
        kinds: per slot `CYCLE` or `STATUS`.
        stamps_ns: per slot.
        values: per slot the numbers of its record.
    """

    header: NDArray[np.int64]
    kinds: NDArray[np.int64]
    stamps_ns: NDArray[np.int64]
    values: NDArray[np.float64]

    def free_slot(self) -> int:
        """Place for the next record; -1 when the reader is a whole ring behind."""
        produced = int(self.header[PRODUCED])
        return produced % SLOTS if produced - int(self.header[CONSUMED]) < SLOTS else -1


@contextmanager
def created(joints: int) -> Iterator[tuple[int, Ring]]:
    """A new ring in anonymous memory, which vanishes with its last user, and its descriptor."""
    descriptor = os.memfd_create("wamctl-ring")
    try:
        os.ftruncate(descriptor, _bytes(joints))
        yield descriptor, attach(descriptor, joints)
    finally:
        os.close(descriptor)


def attach(descriptor: int, joints: int) -> Ring:
    """The ring behind a descriptor."""
    memory = mmap.mmap(descriptor, _bytes(joints))
    integers = np.frombuffer(memory, np.int64, _HEADER + 2 * SLOTS)
    values = np.frombuffer(memory, np.float64, offset=integers.nbytes)
    return Ring(
        integers[:_HEADER],
        integers[_HEADER : _HEADER + SLOTS],
        integers[_HEADER + SLOTS :],
        values.reshape(SLOTS, _width(joints)),
    )


def _width(joints: int) -> int:
    return max(COLUMNS * joints, NUMBERS + joints)


def _bytes(joints: int) -> int:
    return 8 * (_HEADER + 2 * SLOTS + SLOTS * _width(joints))
