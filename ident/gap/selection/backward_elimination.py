"""Backward elimination: drop effects that are insignificant or that held-out data do not need."""

import numpy as np

from ident.gap.data.blocks import HELD_OUT
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.weighted_fit import mean_log_ratio, predicted_rms
from ident.gap.selection.cross_validation import excites
from ident.gap.selection.significance import has_defining_coefficient, significant
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.settings import CrossValidation, GapSettings, Significance


def drop_insignificant(state: SelectionState, settings: Significance) -> SelectionState:
    """Drop effects whose defining coefficient is no longer significant."""
    if not state.accepted:
        return state
    sure = significant(state.rows, state.current, len(state.accepted), settings)
    kept, lost = [], []
    for effect, clear in zip(state.accepted, sure, strict=True):
        keep = clear or not has_defining_coefficient(effect.candidate)
        (kept if keep else lost).append(effect)
    if not lost:
        return state
    return state.with_only(kept).with_dropped(effect.place for effect in lost)


def drop_unconfirmed(state: SelectionState, settings: GapSettings) -> SelectionState:
    """Drop effects, the worst first, without which the held-out fold is predicted as well."""
    chosen = settings.cross_validation
    while state.accepted:
        gains = [
            _held_out_gain(state, i, chosen) / a.score.gain for i, a in enumerate(state.accepted)
        ]
        worst = int(np.argmin(gains))
        if gains[worst] > chosen.min_confirmed_share:
            break
        state = state.with_only([a for i, a in enumerate(state.accepted) if i != worst])
    return state


def _held_out_gain(state: SelectionState, index: int, settings: CrossValidation) -> float:
    """Gain of one effect beside all others on the held-out fold, at all joints [nats per sample].

    Without it the fit may leave its own joint right and put the error of the parameters that all
    share at the other joints. Infinite where that fold does not excite the effect.
    """
    design = state.current.design(state.rows)
    if not excites(design, index, state.current.fit, HELD_OUT, settings):
        return np.inf
    without = state.with_only([a for i, a in enumerate(state.accepted) if i != index])
    errors = []
    for current in (without.current, state.current):
        here = current.design(state.rows).equations.of([HELD_OUT])
        errors.append(predicted_rms(here, current.fit))
    counts = design.equations.counts[:, HELD_OUT]
    return float(mean_log_ratio(errors[0], errors[1], counts).sum())


def keep_significant(
    state: SelectionState,
    fresh: list[AcceptedEffect],
    larger: CurrentFit,
    settings: Significance,
) -> tuple[list[AcceptedEffect], CurrentFit]:
    """Those of the next effects that are significant, and the model with them.

    Args:
        state: without them.
        fresh: the next effects.
        larger: the model with all of them, or more.
        settings: of the test.
    """
    while fresh:
        if len(larger.accepted) != len(state.current.accepted) + len(fresh):
            larger = state.with_more(fresh)
        sure = significant(state.rows, larger, len(fresh), settings)
        if all(sure):
            break
        fresh = [a for a, s in zip(fresh, sure, strict=True) if s]
    return fresh, larger
