"""Terms on demand: offsets and rotors without a name, where held-out data ask for them.

They are the usual terms of an arm's model. They need no name to be in it: it is enough that folds
and recordings that they were not fitted to are predicted better with them.
"""

from dataclasses import replace

from ident.effects.candidate import Value
from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import Experiment
from ident.gap.naming.certainty import Certainty, Suspected, certainties
from ident.gap.selection.acceptance import next_effects
from ident.gap.selection.candidates import all_candidates
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.gap.settings import GapSettings

_NOT_CLEAR = "it helps prediction, but effect-free data of this arm may gain as much"


def terms_on_demand(
    source: Experiment, state: SelectionState, settings: GapSettings
) -> tuple[Suspected, ...]:
    """Offsets and rotors that predict better, beside the effects that are named.

    Args:
        source: the recordings.
        state: with the named effects.
        settings: of the search.
    """
    least = least_threshold(settings.thresholds, source.reference_model is not None)
    state = replace(state, threshold=least, dropped=frozenset())
    named = len(state.accepted)
    left = [
        h for h in all_candidates(state.current.model.facts) if catalogue()[h.effect].usual_term
    ]
    while left:
        fresh, _ = next_effects(state, left, settings)
        if not fresh:
            break
        state = replace(state, current=state.with_more(fresh), accepted=(*state.accepted, *fresh))
        taken = {a.place for a in state.accepted}
        left = [h for h in left if (h.effect, h.joints) not in taken]
    return _that_carry_over(source, state, named, settings)


def _that_carry_over(
    source: Experiment, state: SelectionState, named: int, settings: GapSettings
) -> tuple[Suspected, ...]:
    """The terms that predict other recordings no worse, the worst left out first."""
    while len(state.accepted) > named:
        judged = certainties(source, state, settings)[named:]
        gains = [1.0 if c.across is None else c.across for _, c in judged]
        worst = min(range(len(gains)), key=lambda i: gains[i])
        if gains[worst] > 0.0:
            terms: list[AcceptedEffect] = list(state.accepted[named:])
            return tuple(
                _term(a, values, c, c.doubt(settings.naming))
                for a, (values, c) in zip(terms, judged, strict=True)
            )
        kept = [a for i, a in enumerate(state.accepted) if i != named + worst]
        state = state.with_only(kept)
    return ()


def _term(effect: AcceptedEffect, values: dict[str, Value], c: Certainty, doubt: str) -> Suspected:
    return Suspected(effect, values, c, doubt or _NOT_CLEAR, in_model=True, is_sure=not doubt)
