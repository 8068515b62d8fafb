"""Leaky bucket of bad cycles: how long drives may answer badly before the arm stops."""

from collections.abc import Sequence

from wamctl.drives.interface import Readings


class BadCycleCounter:
    """A count that bad cycles raise and good ones lower.

    A drive that answers badly more often than well is found like one that never answers well.

    Args:
        names: what to call each drive.
        limit: the count that stops the arm.
        in_order: whether answers out of turn are bad.
    """

    def __init__(self, names: Sequence[str], limit: int, in_order: bool) -> None:
        self._names, self._limit, self._in_order = names, limit, in_order
        self._count = 0

    def note(self, readings: Readings, periods: int) -> str | None:
        """Why the arm must stop, as the start of a sentence; None while it need not.

        Args:
            readings: of a cycle.
            periods: for how many periods it waited for them.
        """
        what = self._what(readings)
        self._count = self._count + periods if what else max(0, self._count - 1)
        if not what or self._count < self._limit:
            return None
        return f"{what} in {self._count} cycles (limit {self._limit})"

    def _what(self, readings: Readings) -> str:
        if readings.late:
            return f"positions from {self._listed(readings.late)} came too late for their cycle"
        if readings.missing:
            return f"no position from {self._listed(readings.missing)}"
        if readings.duplicates:
            return f"two positions at once from {self._listed(readings.duplicates)}"
        if readings.out_of_order and self._in_order:
            return (
                f"positions from {self._listed(readings.out_of_order)} came behind those that "
                "follow them (safety.answers_in_order)"
            )
        return ""

    def _listed(self, slots: Sequence[int]) -> str:
        return ", ".join(self._names[slot] for slot in slots)
