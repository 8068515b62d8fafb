"""Waiting for the other side of the wire."""

import ctypes
import errno
import os
import time
from collections.abc import Sequence
from typing import Protocol

_LOOK_OUT_NS = 50_000
_READABLE = 1  # POLLIN

_kernel = ctypes.CDLL(None, use_errno=True)


class Source(Protocol):
    """Something that `poll` takes."""

    def fileno(self) -> int:
        """Its descriptor."""
        ...


class _Poll(ctypes.Structure):
    _fields_ = (("descriptor", ctypes.c_int), ("asked", ctypes.c_short), ("found", ctypes.c_short))


class _Time(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


def readable(sources: Sequence[Source], timeout_s: float | None) -> list[Source]:
    """Those of the sources that can be read, after waiting at most so long [s].

    One call of the system; Python's own `select` reads the clock as well.
    """
    polled = (_Poll * len(sources))(*[(s.fileno(), _READABLE, 0) for s in sources])
    limit = None
    if timeout_s is not None:
        limit = ctypes.byref(_Time(int(timeout_s), int(timeout_s % 1.0 * 1e9)))
    while _kernel.ppoll(polled, len(sources), limit, None) < 0:
        if (number := ctypes.get_errno()) != errno.EINTR:
            raise OSError(number, os.strerror(number))
    return [source for source, poll in zip(sources, polled, strict=True) if poll.found]


def soon_readable(sources: Sequence[Source], timeout_s: float | None) -> list[Source]:
    """The same, for what may come at any moment.

    Looking out for it for about as long as a wake-up takes is cheaper than to sleep at once. For
    longer it would not be: on a busy machine, who burns his share of the core gets it later.
    """
    patient_until = time.monotonic_ns() + _LOOK_OUT_NS
    while time.monotonic_ns() < patient_until:
        found = readable(sources, 0.0)
        if found:
            return found
        os.sched_yield()
    return readable(sources, timeout_s)
