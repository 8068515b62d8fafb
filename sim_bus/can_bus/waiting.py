"""Waiting for the other side of the wire."""

import os
import select
import time
from collections.abc import Sequence
from typing import Protocol

_LOOK_OUT_NS = 50_000


class Source(Protocol):
    """Something that `select` takes."""

    def fileno(self) -> int:
        """Its descriptor."""
        ...


def readable(sources: Sequence[Source], timeout_s: float | None) -> list[Source]:
    """The sources that can be read, after waiting for at most `timeout_s` [s]."""
    return select.select(sources, [], [], timeout_s)[0]


def soon_readable(sources: Sequence[Source], timeout_s: float | None) -> list[Source]:
    """As `readable`, for input that may come at any moment.

    Polling for about as long as a wake-up takes is cheaper than sleeping at once. Polling longer is
    not: on a busy machine a process that burns its share of the core is scheduled later.
    """
    patient_until = time.monotonic_ns() + _LOOK_OUT_NS
    while time.monotonic_ns() < patient_until:
        found = readable(sources, 0.0)
        if found:
            return found
        os.sched_yield()
    return readable(sources, timeout_s)
