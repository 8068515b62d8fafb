"""Sleeping until an instant of the monotonic clock, by one call of the system."""

import ctypes
import errno
import time

_ABSOLUTE = 1
_SECOND_NS = 1_000_000_000


class Timespec(ctypes.Structure):
    """The C library's `struct timespec`."""

    _fields_ = (("tv_sec", ctypes.c_long), ("tv_nsec", ctypes.c_long))


_nanosleep = ctypes.CDLL(None).clock_nanosleep


def sleep_until(due_ns: int) -> None:
    """Sleep until an instant of the monotonic clock [ns]; not at all where it has passed.

    `time.sleep` reads the clock to find the same instant, after its caller has read it to find
    the duration, and what passes between the two readings makes it late.
    """
    target = ctypes.byref(Timespec(*divmod(due_ns, _SECOND_NS)))
    while _nanosleep(time.CLOCK_MONOTONIC, _ABSOLUTE, target, None) == errno.EINTR:
        continue  # Python has run the signal's handler meanwhile
