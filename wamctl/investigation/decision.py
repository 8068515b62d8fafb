"""When an investigation is over, and with which verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

from wamctl.investigation.evidence import odds_text
from wamctl.investigation.state import Round

NAMED, NO_GAP, AMBIGUOUS, UNKNOWN = "named", "no_gap", "ambiguous", "unknown"


@dataclass(frozen=True)
class Decision:
    """The end.

    Attributes:
        verdict: named, no_gap, ambiguous or unknown.
        confirmed: whether a motion after the first has borne it out.
        sentence: why it ends here.
    """

    verdict: str
    confirmed: bool
    sentence: str


def decided(rounds: Sequence[Round]) -> Decision | None:
    """The verdict, if it is final; None: another motion is wanted."""
    last = rounds[-1]
    whole = [r for r in rounds if r.stopped is None]
    if last.stopped is not None or len(whole) < 2:
        return None
    if is_confirmed(last) and last.answer == last.leader and last.verdict in (NAMED, AMBIGUOUS):
        least = min(last.evidence.values())
        text = (
            f"{last.leader} predicted a new motion better than every rival: the odds are at least"
            f" {odds_text(least)}, and {odds_text(last.asked)} were asked."
        )
        return Decision(NAMED, True, text)
    if last.is_altered:
        return None
    before = whole[-2]
    if last.verdict == before.verdict == NO_GAP and not _overtaken(last):
        return Decision(NO_GAP, True, "Two different motions show no gap.")
    if last.verdict == before.verdict == UNKNOWN:
        return Decision(UNKNOWN, True, "Two different motions show a gap that has no name.")
    return None


def ended(rounds: Sequence[Round], reason: str) -> Decision:
    """The verdict where no further motion can be made.

    Args:
        rounds: all of them.
        reason: which bound is reached, or why there is no motion.
    """
    whole = [r for r in rounds if r.verdict]
    last = whole[-1].verdict if whole else AMBIGUOUS
    text = f"No further motion: {reason}."
    if last in (NO_GAP, UNKNOWN):
        return Decision(last, False, f"{text} The last verdict is not confirmed.")
    return Decision(AMBIGUOUS, False, f"{text} No answer is confirmed against its rivals.")


def is_confirmed(item: Round) -> bool:
    """Whether the leader has beaten every rival by what was asked before the motion."""
    return bool(item.evidence) and min(item.evidence.values()) >= item.asked


def _overtaken(item: Round) -> bool:
    """Whether a rival predicted the motion so much better that the leader is refuted."""
    return any(-nats >= item.asked for nats in item.evidence.values())
