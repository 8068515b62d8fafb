"""Letting go of effects that the data do not bear: held-out ones, or the sureness of their size."""

import numpy as np

from ident.effects.candidate import Candidate
from ident.gap.regression.current_model import HELD_OUT, CurrentFit
from ident.gap.regression.design_matrix import build_design_matrix
from ident.gap.regression.weighted_fit import mean_log_ratio, predicted_rms
from ident.gap.selection.acceptance import AcceptedEffect, extend_model
from ident.gap.selection.cross_validation import excites
from ident.gap.selection.estimates import clear
from ident.gap.selection.state import SelectionState, with_only

_BORNE = 0.1  # of an effect's gain: what it must bring on the held-out fold beside all others


def drop_insignificant(way: SelectionState) -> bool:
    """Let go of an effect that would be another one without what is no longer sure of it."""
    if not way.found:
        return False
    sure = clear(way.rows, way.present, len(way.found))
    lost = [f for f, c in zip(way.found, sure, strict=True) if not c]
    lost = [f for f in lost if may_be_another(f.hypothesis)]
    if not lost:
        return False
    way.unsure |= {(f.hypothesis.effect, f.hypothesis.joints) for f in lost}
    way.found = [f for f in way.found if not any(f is x for x in lost)]
    way.present = with_only(way, way.found)
    return True


def confirm(way: SelectionState) -> None:
    """Let go of effects without which the held-out data are predicted as well."""
    while way.found:
        gains = [_held_gain(way, i) / f.score.gain for i, f in enumerate(way.found)]
        worst = int(np.argmin(gains))
        if gains[worst] > _BORNE:
            return
        way.found = [f for i, f in enumerate(way.found) if i != worst]
        way.present = with_only(way, way.found)


def _held_gain(way: SelectionState, index: int) -> float:
    """By how much one of the effects shrinks the held-out residual of its joints [nats]."""
    effect = way.found[index]
    without = with_only(way, [f for i, f in enumerate(way.found) if i != index])
    errors = []
    for present in (without, way.present):
        table = build_design_matrix(way.rows, present.model, present.accepted)
        if present is way.present and not excites(table, index, present.fit, HELD_OUT):
            return np.inf
        there = table.grams.of([HELD_OUT])
        errors.append(predicted_rms(there, present.fit))
    gains = mean_log_ratio(errors[0], errors[1], there.counts[:, 0])
    return float(gains[list(effect.seat)].sum())


def keep_significant(
    way: SelectionState, fresh: list[AcceptedEffect], larger: CurrentFit
) -> tuple[list[AcceptedEffect], CurrentFit]:
    """Those effects whose size is surely not zero, and the model with them."""
    while fresh:
        if len(larger.accepted) != len(way.present.accepted) + len(fresh):
            larger = extend_model(way.rows, way.present, fresh)
        kept = [f for f, c in zip(fresh, clear(way.rows, larger, len(fresh)), strict=True) if c]
        if len(kept) == len(fresh):
            break
        fresh = kept
    return fresh, larger


def may_be_another(h: Candidate) -> bool:
    """Whether an effect without a part of it that is not sure is another one."""
    return any(c.defining for c in h.coefficients)
