"""When an investigation is over, and with which verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

from wamctl.investigation.evidence import (
    ALPHA,
    SEARCH_NATS,
    asked,
    odds_text,
    signed_evidence,
    words,
)
from wamctl.investigation.state import AMBIGUOUS, NAMED, NO_GAP, UNKNOWN, Round

NONE = "none"

REFUTED = SEARCH_NATS
"""A form is given up once a freer answer predicts better with odds of twenty to one [nats]."""


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
        least = min(nats for r, nats in known(rounds, answer).items() if r != UNKNOWN)
        text = (
            f"A new motion has borne out {words(answer)}: odds of {odds_text(least)} over the"
            f" nearest rival, where {odds_text(_bar(rounds, answer))} were asked."
        )
        return Decision(NAMED, True, text, answer)
    if last.is_altered:
        return None
    if last.verdict == UNKNOWN and _has_curve_ahead_of_all(rounds):
        text = "A new motion has borne out a measured curve against every answer with a name."
        return Decision(UNKNOWN, True, text, UNKNOWN)
    if last.verdict != whole[-2].verdict or suspect_that_leads(rounds):
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
    better, nats = _better_than_no_effect(whole)
    if better and whole[-1].verdict == UNKNOWN and has_refuted_form(whole, better):
        told = f"A measured curve predicted the motions better than {words(better)}"
        return Decision(UNKNOWN, False, f"{text} {told}, but is not confirmed.", UNKNOWN)
    if better and whole[-1].is_suspicion:
        told = f"{words(better)} predicted the motions better than no effect, with odds of"
        return Decision(AMBIGUOUS, False, f"{text} {told} {odds_text(nats)}, but is not confirmed.")
    return Decision(last, False, f"{text} The last verdict is not confirmed.")


def suspect_that_leads(rounds: Sequence[Round]) -> str:
    """The effect that leads the next round though `ident gap` does not name it; empty: none.

    Its size is below what one search may name, but motions that it predicted beforehand may bear
    it out. What `ident gap` suspects leads once its prediction was better than that of no effect,
    anything else once it has beaten no effect by what was asked. A measured curve leads in its
    place once it has refuted its form.
    """
    whole = [r for r in rounds if r.verdict]
    if not whole or not whole[-1].is_suspicion:
        return ""
    last = whole[-1]
    ahead = _ahead(last, last.suspected)
    if ahead or last.leader in last.suspected:
        suspect = ahead or last.leader
        is_other = last.verdict == UNKNOWN and has_refuted_form(whole, suspect)
        return UNKNOWN if is_other else suspect
    return _better_than_no_effect(whole)[0] if last.verdict == NO_GAP else ""


def has_refuted_form(rounds: Sequence[Round], answer: str) -> bool:
    """Whether a measured curve has predicted better than an answer of the last plan.

    A curve at the joint of an effect is freer than the effect: it need not be beaten, since it
    predicts as well where the form is right, but may not be ahead.
    """
    return answer != UNKNOWN and known(rounds, answer).get(UNKNOWN, 0.0) <= -REFUTED


def _has_curve_ahead_of_all(rounds: Sequence[Round]) -> bool:
    """Whether a measured curve has beaten all other answers of the last plan by what is asked."""
    ahead = known(rounds, UNKNOWN)
    return bool(ahead) and min(ahead.values()) >= _bar(rounds, UNKNOWN)


def _has_failed_curve(item: Round) -> bool:
    """Whether no effect predicted the motion better than the measured curve did."""
    return item.leader == UNKNOWN and item.evidence.get(NONE, 0.0) < 0.0


def _may_be_refuted(rounds: Sequence[Round], left: int) -> bool:
    """Whether no effect is behind an answer that will have refuted it after the motions left.

    If each of them shows as much as those that compared the two have shown.
    """
    answer, nats = _over_no_effect(rounds)
    compared = sum({answer, NONE} <= {r.leader, *r.bets} for r in rounds)
    return nats > 0.0 and nats * (1.0 + left / compared) >= rounds[-1].asked


def _better_than_no_effect(rounds: Sequence[Round]) -> tuple[str, float]:
    """The answer that has beaten no effect by what was asked, and by how much [nats], or empty."""
    answer, nats = _over_no_effect(rounds)
    return (answer, nats) if answer and nats >= rounds[-1].asked else ("", 0.0)


def _over_no_effect(rounds: Sequence[Round]) -> tuple[str, float]:
    """The effect that is furthest ahead of no effect, and by how much [nats]; empty: none is."""
    last = rounds[-1]
    effects = {last.leader, *last.bets} - {NONE, UNKNOWN} if last.leader != UNKNOWN else set()
    ahead = {e: known(rounds, e).get(NONE, 0.0) for e in sorted(effects)}
    answer = max(ahead, key=lambda e: ahead[e], default="")
    return (answer, ahead[answer]) if answer and ahead[answer] > 0.0 else ("", 0.0)


def borne_out(rounds: Sequence[Round]) -> str:
    """The answer that has beaten every other one by what was asked; empty: none has.

    It is what `ident gap` names of all logs, or, where that names nothing, what it suspects or what
    led although it sees nothing. What `ident gap` calls ambiguous, although it has seen these
    motions, needs a motion of the changed arm, which no search has seen: two models that are wrong
    alike can predict at different odds. So does what it does not see beside a lookalike. None is
    borne out whose form a measured curve has refuted, or whose form no prediction can settle.
    """
    last = rounds[-1]
    altered = any(r.is_altered for r in rounds)
    found = (
        [last.answer] if last.verdict == NAMED or (altered and last.verdict == AMBIGUOUS) else []
    )
    found += last.suspected if last.is_suspicion else []
    is_alone = last.leader not in (NONE, UNKNOWN) and (altered or not last.lookalikes)
    found += [last.leader] if last.verdict == NO_GAP and is_alone else []
    for answer in found:
        if answer in last.unsettled or has_refuted_form(rounds, answer):
            continue
        ahead = {r: nats for r, nats in known(rounds, answer).items() if r != UNKNOWN}
        if ahead and min(ahead.values()) >= _bar(rounds, answer):
            return answer
    return ""


def known(rounds: Sequence[Round], answer: str) -> dict[str, float]:
    """Evidence of an answer of the last plan over each other one, from all rounds that had both."""
    last = rounds[-1]
    answers = [last.leader, *last.bets]
    if not last.bets or answer not in answers:
        return {}
    return {r: signed_evidence(between(rounds, answer, r)) for r in answers if r != answer}


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


def between(rounds: Sequence[Round], answer: str, rival: str) -> list[list[float]]:
    """Log-likelihood ratios of two answers, by block, in each round that had both [nats]."""
    found = list[list[float]]()
    for item in rounds:
        nothing = [0.0] * len(next(iter(item.bets.values()), []))
        behind = {item.leader: nothing, **item.bets}  # of each answer, the leader's lead
        if answer in behind and rival in behind:
            found.append([b - a for a, b in zip(behind[answer], behind[rival], strict=True)])
    return found


def _ahead(item: Round, among: Sequence[str]) -> str:
    """The rival that is furthest ahead of the leader; empty: none is."""
    rivals = {r: -nats for r, nats in item.evidence.items() if r in among}
    rival = max(rivals, key=lambda r: rivals[r], default="")
    return rival if rival and rivals[rival] > 0.0 else ""
