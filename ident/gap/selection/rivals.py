"""Rivals: other effects, and other forms of the same one, that the data cannot tell apart.

Two models are compared by the difference of their log-likelihoods over independent rows (a Bayes
factor between models of equal size).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.residuals import autocorrelation_length, residuals
from ident.gap.regression.weighted_fit import Fit, mean_squares
from ident.gap.selection.cross_validation import fold_gains
from ident.gap.selection.refinement import refine_nonlinear_parameters
from ident.gap.selection.scoring import Score, main_joints
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.settings import GapSettings, Rivals
from ident.signals.arrays import Array


def accept(
    state: SelectionState,
    design: DesignMatrix,
    score: Score,
    scores: Sequence[Score],
    settings: GapSettings,
) -> AcceptedEffect:
    """The effect refined, with the rivals among some scores that cannot be told from it.

    Args:
        state: of the search.
        design: with the effect's columns.
        score: of the effect.
        scores: of all candidates; none are compared where there are none.
        settings: of the search.
    """
    before = state.current.fit
    best, *forms = refine_nonlinear_parameters(state.rows, state.current, score, settings.scoring)
    joints = main_joints(score, before, settings.scoring)
    rows = _independent_rows(design, score)
    others = _refined_rivals(state, score, scores, joints, settings)
    return AcceptedEffect(
        best,
        joints,
        np.maximum(mean_squares(before) - mean_squares(best.fit), 0.0),
        tuple(g.carried for g in fold_gains(design, score, before, settings.cross_validation)),
        tuple(s for s in others if cannot_tell(best, s, before, rows, settings.rivals)),
        others[0] if others else None,
        _equivalent_forms(best, forms, before, rows, settings.rivals),
        tuple(s for s in forms if best.gain - s.gain < settings.rivals.near_form_gain),
    )


def told_apart(named: Sequence[AcceptedEffect]) -> list[AcceptedEffect]:
    """The named effects, none of which is another one's rival: the model needs each beside it."""
    places = {a.place for a in named}
    return [
        replace(
            a,
            rivals=tuple(
                r for r in a.rivals if (r.candidate.effect, r.candidate.joints) not in places
            ),
        )
        for a in named
    ]


def yields_to_constant(leader: AcceptedEffect, scores: Sequence[Score], settings: Rivals) -> bool:
    """Whether a more usual effect at the same joints, constant in time, explains it as well.

    An effect that changes with time yields to any other one that reaches a good share of its gain;
    every one yields to an offset or a rotor that reaches nearly all of it or cannot be told from
    it, and is its rival then.
    """
    own = catalogue()[leader.candidate.effect]
    in_time = own.form_uncertainty is FormUncertainty.TIME
    if own.usual_term:
        return False
    usual = [r.candidate for r in leader.rivals if catalogue()[r.candidate.effect].usual_term]
    if any(set(r.joints) <= set(leader.joints) for r in usual):
        return True
    for s in scores:
        other = catalogue()[s.candidate.effect]
        if in_time and other.form_uncertainty is not FormUncertainty.TIME:
            share = settings.constant_share
        elif other.usual_term:
            share = settings.gain_ratio
        else:
            continue
        if set(s.candidate.joints) <= set(leader.joints) and s.gain >= share * leader.score.gain:
            return True
    return False


def _refined_rivals(
    state: SelectionState,
    score: Score,
    scores: Sequence[Score],
    joints: tuple[int, ...],
    settings: GapSettings,
) -> list[Score]:
    """The best candidates of other effects at the same joints, refined, best first."""
    best: dict[tuple[str, tuple[int, ...]], Score] = {}
    for s in scores:
        if s.candidate.effect != score.candidate.effect:
            best.setdefault((s.candidate.effect, s.candidate.joints), s)
    near = [
        s
        for s in best.values()
        if s.gain > settings.rivals.tuned_share * score.gain
        and set(main_joints(s, state.current.fit, settings.scoring)) & set(joints)
    ]
    refined = (
        refine_nonlinear_parameters(state.rows, state.current, s, settings.scoring)[0] for s in near
    )
    return sorted(refined, key=lambda s: -s.gain)


def _equivalent_forms(
    best: Score, forms: Sequence[Score], before: Fit, rows: Array, settings: Rivals
) -> tuple[Score, ...]:
    """Forms that explain nearly as much; the true form may lie between them."""
    return tuple(
        s
        for s in forms
        if log_likelihood_ratio(best, s, before, rows) < settings.log_likelihood
        or best.gain - s.gain < settings.form_gain
    )


def _independent_rows(design: DesignMatrix, score: Score) -> Array:
    """Number of independent rows per joint, shape (n,)."""
    left = residuals(design, score.fit)
    lengths = [autocorrelation_length(r.values * ~r.excluded, r.block) for r in left]
    return score.fit.counts.sum(axis=1) / np.array(lengths)


def log_likelihood_ratio(leader: Score, rival: Score, before: Fit, rows: Array) -> float:
    """Log-likelihood by which the leader beats the rival.

    Args:
        leader: one score.
        rival: the other.
        before: the fit without either.
        rows: number of independent rows per joint, shape (n,).
    """
    better = leader.fit.gains_over(before) - rival.fit.gains_over(before)
    return float(better @ rows)


def cannot_tell(leader: Score, rival: Score, before: Fit, rows: Array, settings: Rivals) -> bool:
    """Whether the data cannot tell a rival from the leader; a special case of it is no rival."""
    names = leader.candidate.effect, rival.candidate.effect
    first, second = (catalogue()[name] for name in names)
    if names[1] in first.contains or names[0] in second.contains:
        return False
    alike = names[1] in first.rivals or names[0] in second.rivals
    if alike and _lead(leader, rival, before) < settings.lookalike_gain:
        return True
    likely = log_likelihood_ratio(leader, rival, before, rows) > settings.log_likelihood
    return not likely or rival.gain > settings.gain_ratio * leader.gain


def _lead(leader: Score, rival: Score, before: Fit) -> float:
    """Gain by which the leader beats a lookalike [nats per sample].

    What shows mainly while its joints slide has to lead there: how friction turns round is never
    known well enough to decide between two that look alike.
    """
    sliding = leader.fit.sliding_gain_over(before)
    whole = leader.gain - rival.gain
    if sliding < leader.gain - sliding:
        return whole
    return min(whole, sliding - rival.fit.sliding_gain_over(before))
