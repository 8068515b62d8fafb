"""Which frames answer this cycle's SYNC: none older, none late, none twice, none out of turn."""

from collections.abc import Sequence

from wamctl.drives.interface import WINDOW, Counters


class Answers:
    """The drives' answers to one SYNC, as they come in.

    A drive answers each SYNC once. Where its answer stays away, it may be lost or late, and a late
    one is not to pass for the answer to a later SYNC: its time stamp tells, which the bus made
    when it passed, however late this program comes to read it.

    Attributes:
        identifiers: of all answers.
        missing: places of the drives whose answer has not come.
        late: places of those with an answer to an older SYNC, or one behind the window.
        duplicates: places of those that answered more than once.
        out_of_order: places of those that answered out of order.

    Args:
        names: what to call each drive.
        identifiers: of each drive's answer. Arbitration lets the lowest one go first, so that this
            is the plan for drives that answer at once.
        period_s: SYNC to SYNC [s].
    """

    def __init__(self, names: Sequence[str], identifiers: Sequence[int], period_s: float) -> None:
        order = sorted(identifiers)
        self.counters = Counters(lost_by_drive=dict.fromkeys(names, 0))
        self.identifiers = frozenset(identifiers)
        self._names = names
        self._rank = [order.index(identifier) for identifier in identifiers]
        self._window_s = WINDOW * period_s
        self.begin()

    def begin(self) -> None:
        """A new cycle."""
        self.missing = set(range(len(self._rank)))
        self.late: set[int] = set()
        self.duplicates: set[int] = set()
        self.out_of_order: set[int] = set()
        self._furthest = -1

    def leave_out(self, slot: int) -> None:
        """An answer to an older SYNC has come, which is too late for any use."""
        self.late.add(slot)
        self.counters.late += 1

    def admit(self, slot: int, age_s: float) -> bool:
        """Whether an answer belongs to this cycle.

        Args:
            slot: place of its drive.
            age_s: from this cycle's SYNC to when the frame passed [s]; negative for older frames.
        """
        if age_s < 0.0:
            self.leave_out(slot)
            return False
        if slot not in self.missing:
            self.duplicates.add(slot)
            self.counters.doubled += 1
            return True
        self.missing.discard(slot)
        if age_s > self._window_s:
            self.leave_out(slot)
        elif self._rank[slot] < self._furthest:
            self.out_of_order.add(slot)
            self.counters.reordered += 1
        self._furthest = max(self._furthest, self._rank[slot])
        return True

    def end(self) -> None:
        """No more answers are awaited in this cycle: those that are missing are lost."""
        for slot in self.missing:
            self.counters.lost += 1
            self.counters.lost_by_drive[self._names[slot]] += 1
