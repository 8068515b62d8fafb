"""Terms on demand: what stands in the model without a name, where held-out data ask for it.

Offsets and rotors are the usual terms of an arm's model: it is enough that folds and recordings
that they were not fitted to are predicted better with them. Another effect that is not sure enough
to be named needs a second recording that asks for it: stretches of one motion look alike.
"""

from collections.abc import Sequence, Set
from dataclasses import replace

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import Experiment
from ident.gap.naming.certainty import Certainty, Suspected, certainties
from ident.gap.selection.acceptance import next_effects
from ident.gap.selection.backward_elimination import drop_unconfirmed
from ident.gap.selection.candidates import all_candidates, special_cases
from ident.gap.selection.state import AcceptedEffect, Place, SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.gap.settings import GapSettings

_NOT_CLEAR = "it helps prediction, but effect-free data of this arm may gain as much"
_NOT_CONFIRMED = "it helps prediction, but hardly where the search had not looked"


def terms_on_demand(
    source: Experiment,
    state: SelectionState,
    suspected: Sequence[Suspected],
    settings: GapSettings,
) -> tuple[Suspected, ...]:
    """Offsets, rotors and suspected effects that predict better, beside those that are named.

    One that passes all that a name has to pass is sure: the search leaves a place for good that was
    not sure beside what it had then.

    Args:
        source: the recordings.
        state: with the named effects, and the thresholds for them.
        suspected: what was set apart from them.
        settings: of the search.
    """
    least = least_threshold(settings.thresholds, source.reference_model is not None)
    before, named = state, len(state.accepted)
    state = replace(state, threshold=least, dropped=frozenset())
    surely = {a.place for a in before.accepted}
    carried = {
        s.effect.place
        for s in suspected
        if (s.certainty.across or 0.0) > 0.0 and not surely & _special_cases(s.candidate)
    }
    left = [
        h
        for h in all_candidates(state.current.model.facts)
        if catalogue()[h.effect].usual_term or (h.effect, h.joints) in carried
    ]
    while left:
        fresh, _ = next_effects(state, left, settings)
        if not fresh:
            break
        state = replace(state, current=state.with_more(fresh), accepted=(*state.accepted, *fresh))
        taken = {a.place for a in state.accepted}
        left = [h for h in left if (h.effect, h.joints) not in taken]
    terms = _that_carry_over(source, state, named, settings)
    whole = before.with_only([*before.accepted, *(t.effect for t in terms)])
    confirmed = {a.place for a in drop_unconfirmed(whole, settings).accepted}
    known = {s.effect.place for s in suspected}
    return tuple(
        t if t.doubt or t.effect.place in known else _judged(t, before, confirmed) for t in terms
    )


def _special_cases(candidate: Candidate) -> set[Place]:
    return {(h.effect, h.joints) for h in special_cases(candidate)}


def _judged(term: Suspected, before: SelectionState, confirmed: Set[Place]) -> Suspected:
    """A term that the search itself did not set apart, with what speaks against its name."""
    least, gain = before.threshold.of(term.candidate.effect), term.effect.score.gain
    doubt = "" if before.calibrations and gain >= least else _NOT_CLEAR
    return replace(term, doubt=doubt or ("" if term.effect.place in confirmed else _NOT_CONFIRMED))


def _that_carry_over(
    source: Experiment, state: SelectionState, named: int, settings: GapSettings
) -> tuple[Suspected, ...]:
    """The terms that predict other recordings no worse, the worst left out first."""
    while len(state.accepted) > named:
        judged = certainties(source, state, settings)[named:]
        terms: list[AcceptedEffect] = list(state.accepted[named:])
        gains = [_carried(a, c) for a, (_, c) in zip(terms, judged, strict=True)]
        worst = min(range(len(gains)), key=lambda i: gains[i])
        if gains[worst] > 0.0:
            return tuple(
                Suspected(a, values, c, c.doubt(settings.naming), in_model=True)
                for a, (values, c) in zip(terms, judged, strict=True)
            )
        kept = [a for i, a in enumerate(state.accepted) if i != named + worst]
        state = state.with_only(kept)
    return ()


def _carried(effect: AcceptedEffect, c: Certainty) -> float:
    """Gain on other recordings; none where that is not known, or the size makes no sense."""
    if not c.in_bounds:
        return 0.0
    if catalogue()[effect.candidate.effect].usual_term:
        return 1.0 if c.across is None else c.across
    return c.across if c.across is not None and c.deviations > 1.0 else 0.0
