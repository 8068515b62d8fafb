"""Whether a run with a fault ended in a defined stop, by what its arm saw and what was logged."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

from fault_witness import Span, Testimony

from wamctl.arm.errors import UserError
from wamctl.errors import StopError

PERIOD_S = 0.002
PERIOD_NS = round(PERIOD_S * 1e9)
MOST_CYCLES, MOST_MS = 2.0, 100.0


@dataclass(frozen=True)
class Stop:
    """What became of torque and drives.

    Attributes:
        found_ms: from the fault to its detection [ms].
        cycles: from detection until no torque of before acts [cycles].
        off_ms: from detection until no drive is enabled [ms].
        for_good: at the end there is no torque, and no drive is enabled.
    """

    found_ms: float
    cycles: float
    off_ms: float
    for_good: bool


@dataclass(frozen=True)
class Ending:
    """How a run ended.

    Attributes:
        code: exit code; 0 when it went on to its end.
        sentence: what was said.
        stop: what became of torque and drives; None when it went on to its end.
        missed: what of a defined stop was missed.
    """

    code: int
    sentence: str
    stop: Stop | None
    missed: tuple[str, ...]


def judged(
    error: UserError | None, seen: Testimony, stamps_ns: Sequence[int], unheard: bool
) -> Ending:
    """Whether this was a defined stop.

    Args:
        error: what ended the run.
        seen: what the arm saw of it.
        stamps_ns: of the rows that were logged.
        unheard: the host is off the bus.
    """
    if not isinstance(error, StopError) or not seen.said:
        said = "; ".join(seen.said) or "the fault never began"
        code = error.exit_code if error else 0
        return Ending(code, f"{said}; {error}" if error else said, None, ("no stop",))
    began = re.search(r" begins at ([0-9.]+) s, cycle (\d+)", seen.said[0])
    if began is None:
        raise ValueError(seen.said[0])
    detected_ns = seen.first_ns + round(error.at_s * 1e9)
    stop = stopped(error.brakes, seen.spans, detected_ns, round(float(began[1]) * 1e9))
    checks = {
        "exit code": error.exit_code in (4, 5),
        "one sentence": "\n" not in str(error),
        f"torque of before for {stop.cycles:.2f} cycles": unheard or stop.cycles <= MOST_CYCLES,
        f"drives disabled after {stop.off_ms:.1f} ms": stop.off_ms <= MOST_MS,
        "disabled for good": stop.for_good,
        "whole log": is_whole(stamps_ns, int(began[2])),
    }
    missed = tuple(what for what, holds in checks.items() if not holds)
    return Ending(error.exit_code, str(error), stop, missed)


def stopped(brakes: bool, spans: Sequence[Span], detected_ns: int, began_ns: int) -> Stop:
    """What became of torque and drives; in a braked stop, until their torques are new ones."""
    after = [span for span in spans if span.until_ns > detected_ns]
    old = [span for span in after if any(span.torques)]
    if brakes:
        old = list(takewhile(lambda span: span.torques == after[0].torques, old))
    old_ns = old[-1].until_ns if old else detected_ns
    off_ns = max((span.until_ns for span in after if span.enabled), default=detected_ns)
    last = spans[-1]
    return Stop(
        max(0.0, (detected_ns - began_ns) * 1e-6),
        (old_ns - detected_ns) / PERIOD_NS,
        (off_ns - detected_ns) * 1e-6,
        not any(last.torques) and not last.enabled,
    )


def is_whole(stamps_ns: Sequence[int], fault_cycle: int) -> bool:
    """Whether all cycles before that of the fault were logged; the first is 1."""
    logged = {(stamp_ns - stamps_ns[0]) // PERIOD_NS + 1 for stamp_ns in stamps_ns}
    return set(range(1, fault_cycle)) <= logged
