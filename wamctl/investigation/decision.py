"""When an investigation is over, and with which verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

from wamctl.investigation.evidence import odds_text, words
from wamctl.investigation.state import Round

NAMED, NO_GAP, AMBIGUOUS, UNKNOWN = "named", "no_gap", "ambiguous", "unknown"
NONE = "none"


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
    borne_out = last.answer == last.leader and last.verdict in (NAMED, AMBIGUOUS)
    if is_confirmed(last) and (borne_out or _led_by_suspect(last)):
        least = min(last.evidence.values())
        text = (
            f"{words(last.leader)} predicted a new motion better than every rival: with odds of"
            f" {odds_text(least)} or better, where {odds_text(last.asked)} were asked."
        )
        return Decision(NAMED, True, text)
    if last.is_altered:
        return None
    before = whole[-2]
    doubted = _ahead(last, last.suspected)[0] or _ahead(last)[1] >= last.asked
    if last.verdict == before.verdict == NO_GAP and not doubted and not _led_by_suspect(last):
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
    if last not in (NO_GAP, UNKNOWN):
        return Decision(AMBIGUOUS, False, f"{text} No answer is confirmed against its rivals.")
    better, nats = _better_than_no_effect(whole[-1])
    if last == NO_GAP and better:
        told = f"{words(better)} predicted the motions better than no effect, with odds of"
        return Decision(AMBIGUOUS, False, f"{text} {told} {odds_text(nats)}, but is not confirmed.")
    return Decision(last, False, f"{text} The last verdict is not confirmed.")


def suspect_that_leads(rounds: Sequence[Round]) -> str:
    """The suspect whose prediction was better than that of no effect: it leads the next round.

    Its size is below what one search may name, but motions that it predicted beforehand may bear
    it out. Empty: none; what `ident gap` says leads.
    """
    whole = [r for r in rounds if r.verdict]
    if not whole or whole[-1].verdict != NO_GAP:
        return ""
    last = whole[-1]
    return _ahead(last, last.suspected)[0] or (last.leader if _led_by_suspect(last) else "")


def _better_than_no_effect(item: Round) -> tuple[str, float]:
    """The answer that has beaten no effect by what was asked, and by how much [nats], or empty."""
    if _led_by_suspect(item):
        answer, nats = item.leader, item.evidence.get(NONE, 0.0)
    else:
        answer, nats = _ahead(item) if item.leader == NONE else ("", 0.0)
    return (answer, nats) if answer and nats >= item.asked else ("", 0.0)


def _led_by_suspect(item: Round) -> bool:
    return item.verdict == NO_GAP and item.leader in item.suspected


def is_confirmed(item: Round) -> bool:
    """Whether the leader has beaten every rival by what was asked before the motion."""
    return bool(item.evidence) and min(item.evidence.values()) >= item.asked


def _ahead(item: Round, among: Sequence[str] | None = None) -> tuple[str, float]:
    """The rival that is furthest ahead of the leader, and by how much [nats]; empty: none is."""
    known = {r: -nats for r, nats in item.evidence.items() if among is None or r in among}
    rival, nats = max(known.items(), key=lambda pair: pair[1], default=("", 0.0))
    return (rival, nats) if nats > 0.0 else ("", 0.0)
