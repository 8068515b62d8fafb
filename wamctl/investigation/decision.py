"""When an investigation is over, and with which verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

from wamctl.investigation.evidence import ALPHA, asked, odds_text, signed_evidence, words
from wamctl.investigation.state import AMBIGUOUS, NAMED, NO_GAP, UNKNOWN, Round

NONE = "none"


@dataclass(frozen=True)
class Decision:
    """The end.

    Attributes:
        verdict: named, no_gap, ambiguous or unknown.
        confirmed: whether a motion after the first has borne it out.
        sentence: why it ends here.
        answer: that a motion has borne out; empty: none.
    """

    verdict: str
    confirmed: bool
    sentence: str
    answer: str = ""


def decided(rounds: Sequence[Round], left: int) -> Decision | None:
    """The verdict, if it is final; None: another motion is wanted.

    Args:
        rounds: all of them.
        left: motions that there is room for.
    """
    last = rounds[-1]
    whole = [r for r in rounds if r.stopped is None]
    if last.stopped is not None or len(whole) < 2:
        return None
    answer = borne_out(rounds)
    if answer:
        least = min(known(rounds, answer).values())
        text = (
            f"A new motion has borne out {words(answer)}: odds of {odds_text(least)} over the"
            f" nearest rival, where {odds_text(_bar(rounds, answer))} were asked."
        )
        return Decision(NAMED, True, text, answer)
    if last.is_altered:
        return None
    before = whole[-2]
    ahead = last.is_suspicion and bool(_ahead(last, last.suspected)[0])
    if last.verdict != before.verdict or ahead or _led_by_suspect(last):
        return None
    if last.verdict == NO_GAP and not _may_be_refuted(rounds, left):
        return Decision(NO_GAP, True, "Two different motions show no gap.")
    if last.verdict == UNKNOWN and not (left and _has_failed_curve(last)):
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
    if whole[-1].is_suspicion and better:
        told = f"{words(better)} predicted the motions better than no effect, with odds of"
        return Decision(AMBIGUOUS, False, f"{text} {told} {odds_text(nats)}, but is not confirmed.")
    return Decision(last, False, f"{text} The last verdict is not confirmed.")


def suspect_that_leads(rounds: Sequence[Round]) -> str:
    """The suspect whose prediction was better than that of no effect: it leads the next round.

    Its size is below what one search may name, but motions that it predicted beforehand may bear
    it out. Empty: none; what `ident gap` says leads.
    """
    whole = [r for r in rounds if r.verdict]
    if not whole or not whole[-1].is_suspicion:
        return ""
    last = whole[-1]
    return _ahead(last, last.suspected)[0] or (last.leader if _led_by_suspect(last) else "")


def _has_failed_curve(item: Round) -> bool:
    """Whether no effect predicted the motion better than the measured curve did."""
    return item.leader == UNKNOWN and item.evidence.get(NONE, 0.0) < 0.0


def _may_be_refuted(rounds: Sequence[Round], left: int) -> bool:
    """Whether no effect is behind an answer that will have refuted it after the motions left.

    If each of them shows as much as those that compared the two have shown.
    """
    answer, nats = _over_no_effect(rounds[-1])
    compared = sum({answer, NONE} <= {r.leader, *r.bets} for r in rounds)
    return nats > 0.0 and nats * (1.0 + left / compared) >= rounds[-1].asked


def _better_than_no_effect(item: Round) -> tuple[str, float]:
    """The answer that has beaten no effect by what was asked, and by how much [nats], or empty."""
    answer, nats = _over_no_effect(item)
    return (answer, nats) if answer and nats >= item.asked else ("", 0.0)


def _over_no_effect(item: Round) -> tuple[str, float]:
    """The answer that predicted best of all beside no effect, and by how much [nats], or empty."""
    if item.leader == NONE:
        return _ahead(item)
    nats = item.evidence.get(NONE, 0.0) if item.leader != UNKNOWN else 0.0
    return (item.leader, nats) if nats > 0.0 else ("", 0.0)


def _led_by_suspect(item: Round) -> bool:
    return item.is_suspicion and item.leader in item.suspected


def borne_out(rounds: Sequence[Round]) -> str:
    """The answer that has beaten every other one by what was asked; empty: none has.

    It is what `ident gap` names of all logs, or, where that names nothing, what it suspects. What
    `ident gap` calls ambiguous, although it has seen these motions, needs a motion of the changed
    arm, which no search has seen: two models that are wrong alike can predict at different odds.
    """
    last = rounds[-1]
    settled = last.verdict == NAMED or any(r.is_altered for r in rounds)
    found = [last.answer] if settled and last.verdict in (NAMED, AMBIGUOUS) else []
    found += last.suspected if last.is_suspicion else []
    for answer in found:
        ahead = known(rounds, answer)
        if ahead and min(ahead.values()) >= _bar(rounds, answer):
            return answer
    return ""


def known(rounds: Sequence[Round], answer: str) -> dict[str, float]:
    """Evidence of an answer of the last plan over each other one, from all rounds that had both."""
    last = rounds[-1]
    answers = [last.leader, *last.bets]
    if not last.bets or answer not in answers:
        return {}
    return {r: signed_evidence(_ratios(rounds, answer, r)) for r in answers if r != answer}


def asked_of(rounds: Sequence[Round], answer: str) -> float:
    """Evidence that will confirm an answer which leads after some rounds [nats].

    The first one was chosen before any motion was predicted, later ones among all that were.
    """
    leaders = {r.leader for r in rounds if r.leader}
    among = {name for r in rounds if r.bets for name in (r.leader, *r.bets)}
    first = not leaders or answer == next(r.leader for r in rounds if r.leader)
    return asked(ALPHA, len({*leaders, answer}), 1 if first else len(among))


def _bar(rounds: Sequence[Round], answer: str) -> float:
    return rounds[-1].asked if answer == rounds[-1].leader else asked_of(rounds, answer)


def _ratios(rounds: Sequence[Round], answer: str, rival: str) -> list[list[float]]:
    """Log-likelihood ratios of two answers, by block, in each round that had both [nats]."""
    found = list[list[float]]()
    for item in rounds:
        nothing = [0.0] * len(next(iter(item.bets.values()), []))
        behind = {item.leader: nothing, **item.bets}  # of each answer, the leader's lead
        if answer in behind and rival in behind:
            found.append([b - a for a, b in zip(behind[answer], behind[rival], strict=True)])
    return found


def _ahead(item: Round, among: Sequence[str] | None = None) -> tuple[str, float]:
    """The rival that is furthest ahead of the leader, and by how much [nats]; empty: none is."""
    known = {r: -nats for r, nats in item.evidence.items() if among is None or r in among}
    rival, nats = max(known.items(), key=lambda pair: pair[1], default=("", 0.0))
    return (rival, nats) if nats > 0.0 else ("", 0.0)
