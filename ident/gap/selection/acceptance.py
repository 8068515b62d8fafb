"""Accept the next effect: the best-scoring candidate that passes every test.

A candidate must reach its threshold, be more than an accepted effect's wrong form, pass
cross-validation on every fold that excites it, and be plausible. A better candidate that failed
blocks its joints: what explains them best is not in the catalogue, so a worse one is not taken,
unless it is a special case of the better one, which always explains less. One below its threshold
blocks nothing: as much is explained where nothing is missing. A candidate that a simpler constant
effect replaces leaves them free for that one, and its own special cases are taken in its place if
they explain nearly as much together (marginality: Nelder 1977).
"""

from collections.abc import Sequence

from ident.effects.candidate import Candidate, fields_of
from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.gap.regression.current_model import extend
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.selection.candidates import examine, special_cases
from ident.gap.selection.cross_validation import passes_cross_validation
from ident.gap.selection.misspecification import stands_beside_accepted
from ident.gap.selection.refinement import refine_nonlinear_parameters
from ident.gap.selection.rivals import accept, yields_to_constant
from ident.gap.selection.scoring import Score, is_plausible, is_too_small, main_joints
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.settings import GapSettings


def next_effects(
    state: SelectionState, candidates: Sequence[Candidate], settings: GapSettings
) -> tuple[list[AcceptedEffect], tuple[Score, ...]]:
    """The next effect (with the same one at other joints) if any passes, and all scores."""
    design, scores = examine(state.rows, state.current, candidates, settings.scoring)
    blocked: dict[int, set[str]] = {}  # joints, and the effects that may be taken there still
    for score in scores:
        if score.penalised_gain < state.threshold.least:
            break
        if score.gain < state.threshold.of(score.candidate.effect):
            continue  # as much is explained where nothing is missing
        joints = set(main_joints(score, state.current.fit, settings.scoring))
        if any(score.candidate.effect not in blocked[j] for j in joints & blocked.keys()):
            continue
        if _is_significant(state, score) and stands_beside_accepted(state, design, score, settings):
            confirmed = _cross_validated(state, design, score, settings)
            if confirmed is None and not blocked:
                pair = try_pair(state, score, candidates, settings)
                if pair:
                    return pair, tuple(scores)
            leader = None if confirmed is None else accept(state, *confirmed, scores, settings)
            instead = None if leader is None else _instead(state, design, leader, scores, settings)
            if instead:
                return instead, tuple(scores)
            if instead is not None:
                continue
            if leader is not None and _is_plausible(leader):
                alike = _same_effect_elsewhere(state, design, scores, leader, settings)
                return [leader, *alike], tuple(scores)
        for j in joints:
            contained = set(catalogue()[score.candidate.effect].contains)
            blocked[j] = blocked.get(j, contained) & contained
    return [], tuple(scores)


def _is_significant(state: SelectionState, score: Score) -> bool:
    """Whether a score reaches its threshold, has a size, and is not in the model already."""
    return (
        score.gain >= state.threshold.of(score.candidate.effect)
        and not is_too_small(score)
        and not any(_same(a.candidate, score.candidate) for a in state.accepted)
    )


def _instead(
    state: SelectionState,
    design: DesignMatrix,
    leader: AcceptedEffect,
    scores: Sequence[Score],
    settings: GapSettings,
) -> list[AcceptedEffect] | None:
    """Those of its special cases that pass, if an effect yields to them; None if it does not yield.

    None of them where it yields to a more usual effect, whose turn comes.
    """
    if yields_to_constant(leader, scores, settings.rivals):
        return []
    candidates = special_cases(leader.candidate)
    simpler = [s for s in scores if s.candidate in candidates]
    if len(simpler) < 2:
        return None
    together = extend(state.rows, state.current, [s.candidate for s in simpler]).fit
    if together.gain_over(state.current.fit) < settings.rivals.gain_ratio * leader.score.gain:
        return None
    passing = [s for s in simpler if _passes(state, design, s, settings)]
    return [accept(state, design, s, (), settings) for s in passing]


def _is_plausible(effect: AcceptedEffect) -> bool:
    return is_plausible(effect.candidate, effect.score.fit, tuned=True)


def _cross_validated(
    state: SelectionState, design: DesignMatrix, score: Score, settings: GapSettings
) -> tuple[DesignMatrix, Score] | None:
    """The candidate if it passes cross-validation, as it is or once its parameters are refined."""
    now, chosen = state.current.fit, settings.cross_validation
    if passes_cross_validation(design, score, now, chosen):
        return design, score
    refined = refine_nonlinear_parameters(state.rows, state.current, score, settings.scoring)[0]
    if refined.gain < settings.scoring.retuned_gain_ratio * score.gain:
        return None
    design, scores = examine(state.rows, state.current, [refined.candidate], settings.scoring)
    if scores and passes_cross_validation(design, scores[0], now, chosen):
        return design, scores[0]
    return None


def try_pair(
    state: SelectionState, score: Score, candidates: Sequence[Candidate], settings: GapSettings
) -> list[AcceptedEffect]:
    """Try pairs: two effects on one joint that pass cross-validation only jointly."""
    joints = set(main_joints(score, state.current.fit, settings.scoring))
    effect = score.candidate.effect
    near = [h for h in candidates if joints & set(h.joints) and h.effect != effect]
    near = [score.candidate, *near]
    pair = each_beside_the_other(state, score.candidate, near, settings)
    return pair if pair and pair[1].score.gain >= score.gain else []


def each_beside_the_other(
    state: SelectionState, one: Candidate, near: Sequence[Candidate], settings: GapSettings
) -> list[AcceptedEffect]:
    """An effect and the best one beside it, if that one has it as its own best one; else none.

    Args:
        state: without either.
        one: the effect.
        near: candidates, those of the same effect among them.
        settings: of the search.
    """
    others = [h for h in near if h.effect != one.effect]
    second = _best_beside(state, one, others, settings)
    if second is None:
        return []
    again = [h for h in near if h.effect != second.candidate.effect]
    first = _best_beside(state, second.candidate, again, settings)
    if first is None or first.candidate.effect != one.effect:
        return []
    return [first, second]


def _best_beside(
    state: SelectionState,
    other: Candidate,
    candidates: Sequence[Candidate],
    settings: GapSettings,
) -> AcceptedEffect | None:
    """The best candidate beside another effect, if it passes."""
    beside = state.with_current(extend(state.rows, state.current, [other]))
    design, scores = examine(state.rows, beside.current, candidates, settings.scoring)
    if not scores or not _is_significant(beside, scores[0]):
        return None
    confirmed = _cross_validated(beside, design, scores[0], settings)
    leader = None if confirmed is None else accept(beside, *confirmed, scores, settings)
    if leader is None or _instead(beside, design, leader, scores, settings) is not None:
        return None
    return leader if _is_plausible(leader) else None


def _same(first: Candidate, second: Candidate) -> bool:
    """Whether two candidates differ only in parameters that are refined.

    All forms of a curve over speed are tried at once, so that another form is the same effect.
    """
    if (first.effect, first.joints) != (second.effect, second.joints):
        return False
    effect = catalogue()[first.effect]
    curve = effect.form_uncertainty is FormUncertainty.SPEED
    tuned = {p.name for p in effect.nonlinear if not p.discrete or p.refine_only or curve}
    others = fields_of(second.parameters)
    fixed = ((n, v) for n, v in fields_of(first.parameters).items() if n not in tuned)
    return all(others[name] == value for name, value in fixed)


def _same_effect_elsewhere(
    state: SelectionState,
    design: DesignMatrix,
    scores: Sequence[Score],
    leader: AcceptedEffect,
    settings: GapSettings,
) -> list[AcceptedEffect]:
    """The leader's effect at other joints, where it scores best and passes too."""
    if len(leader.candidate.rows) > 1:
        return []
    taken, places, alike = set(leader.joints), {leader.place}, []
    for score in scores:
        joints = set(main_joints(score, state.current.fit, settings.scoring))
        if taken & joints:
            continue
        taken |= joints
        h = score.candidate
        if h.effect != leader.candidate.effect or (h.effect, h.joints) in places:
            continue
        large = score.gain >= settings.scoring.same_effect_share * leader.score.gain
        if large and len(h.rows) == 1 and _passes(state, design, score, settings):
            places.add((h.effect, h.joints))
            alike.append(accept(state, design, score, (), settings))
    return alike


def _passes(
    state: SelectionState, design: DesignMatrix, score: Score, settings: GapSettings
) -> bool:
    return (
        _is_significant(state, score)
        and stands_beside_accepted(state, design, score, settings, use_repeats=False)
        and passes_cross_validation(design, score, state.current.fit, settings.cross_validation)
    )
