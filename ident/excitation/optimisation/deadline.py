"""When a search ends, on whichever clock."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Deadline:
    """A time on a clock.

    Attributes:
        end_s: when to stop [s].
        clock: what tells the time; the default is one that all processes share.
        length_s: how long that was when it was set [s].
    """

    end_s: float
    clock: Callable[[], float] = time.monotonic
    length_s: float = 0.0

    @property
    def over(self) -> bool:
        """Whether the time is over."""
        return self.clock() >= self.end_s

    def again(self) -> "Deadline":
        """The whole time, from now."""
        return replace(self, end_s=max(self.end_s, self.clock() + self.length_s))

    def sooner(self, share: float) -> "Deadline":
        """One that leaves a share of the time from now."""
        return replace(self, end_s=self.end_s - share * max(0.0, self.end_s - self.clock()))


def within(seconds: float, clock: Callable[[], float] = time.monotonic) -> Deadline:
    """So many seconds from now."""
    return Deadline(clock() + seconds, clock, seconds)
