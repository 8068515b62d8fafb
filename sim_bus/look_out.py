"""Waiting for the other side of the wire."""

import os
import select
import time
from collections.abc import Sequence
from typing import Protocol

_LOOK_OUT_NS = 500_000


class Source(Protocol):
    """Something that `select` takes."""

    def fileno(self) -> int:
        """Its descriptor."""
        ...


def readable(sources: Sequence[Source], timeout_s: float | None) -> list[Source]:
    """Those of the sources that can be read, after waiting at most so long [s]."""
    return select.select(sources, [], [], timeout_s)[0]


def soon_readable(sources: Sequence[Source], timeout_s: float | None) -> list[Source]:
    """The same, for what is expected within a fraction of a millisecond.

    Looking out for it is cheaper than to sleep and be woken up, and whoever else wants the core has
    it. It is for lockstep: in real time it would burn the core.
    """
    patient_until = time.monotonic_ns() + _LOOK_OUT_NS
    while time.monotonic_ns() < patient_until:
        found = readable(sources, 0.0)
        if found:
            return found
        os.sched_yield()
    return readable(sources, timeout_s)
