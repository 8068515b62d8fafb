"""When faults begin and end."""

from collections.abc import Sequence
from dataclasses import dataclass

from sim_bus.faults.script import Happens, Lasts, Timed, Trigger

_S = 1e9


@dataclass(frozen=True)
class Instant:
    """A point of a run: its time [ns] and the number of cycles that have been opened."""

    time_ns: int
    cycle: int


class Timeline:
    """The faults of a run, in the order in which they come due.

    Attributes:
        cycle: how many cycles have been opened.
    """

    def __init__(self, faults: Sequence[Happens]) -> None:
        self.cycle = 0
        self._waiting = list(faults)
        self._lasting: list[tuple[Lasts, Instant]] = []
        self._instants: dict[Trigger, Instant] = {}

    def note(self, trigger: Trigger, time_ns: int) -> None:
        """A trigger has come; only its first time counts."""
        self._instants.setdefault(trigger, Instant(time_ns, self.cycle))

    def begun(self, time_ns: int) -> list[Happens]:
        """Faults that begin by now."""
        now = Instant(time_ns, self.cycle)
        begun = [f for f in self._waiting if self._is_due(f, now)]
        if begun:
            self._waiting = [f for f in self._waiting if f not in begun]
            self._lasting += [(f, now) for f in begun if isinstance(f, Lasts)]
        return begun

    def ended(self, time_ns: int) -> list[Lasts]:
        """Faults that end by now."""
        now = Instant(time_ns, self.cycle)
        ended = [
            (fault, since)
            for fault, since in self._lasting
            if _passed(since, now, fault.for_cycles, fault.for_seconds, endless=True)
        ]
        self._lasting = [pair for pair in self._lasting if pair not in ended]
        return [fault for fault, _ in ended]

    def _is_due(self, fault: Timed, now: Instant) -> bool:
        since = self._instants.get(fault.after)
        return since is not None and _passed(since, now, fault.cycles, fault.seconds, endless=False)


def _passed(
    since: Instant, now: Instant, cycles: int | None, seconds: float | None, *, endless: bool
) -> bool:
    if cycles is not None:
        return now.cycle - since.cycle >= cycles
    if seconds is not None:
        return now.time_ns - since.time_ns >= seconds * _S
    return not endless
