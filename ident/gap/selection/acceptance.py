"""From scores to a name: which effect leads, whether it may be believed, and who rivals it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate, fields_of
from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.gap.data.noise_regions import Region
from ident.gap.regression.current_model import (
    CurrentFit,
    examine,
    extend,
    refine_nonlinear_parameters,
)
from ident.gap.regression.design_matrix import Table, WindowedRows
from ident.gap.regression.residuals import memory_of, residuals
from ident.gap.regression.scoring import Score, is_plausible
from ident.gap.regression.weighted_fit import Fit, mean_squares
from ident.gap.selection.cross_validation import held_out_gains, holds
from ident.gap.selection.misspecification import maybe_misspecification, significant_beside
from ident.gap.selection.null_arms import Threshold

Array = NDArray[np.floating]

_SEAT = 0.2  # of the gain: a joint with this much of it is where the effect sits
_NEAR = 0.93  # of the leader's gain: whoever reaches it cannot be told apart
_ALIKE = 0.02  # nats per sample: effects that look alike may differ so much by reversals alone
_WORTH_TUNING = 0.75
_SURE = 4.0  # units of log-likelihood between leader and rival
_FORM = 0.05  # nats per sample: so much less may be the error of the better form
_SAME_SHARE = 0.3
_LOUD = 2.0  # times the noise of repeats: clearly more
_LEFT = 0.2  # of the squared gap above that noise: an effect that leaves less is no form's error
_FAR_OFF = 2.0  # times as much gain with better settings: before, the folds could tell nothing


@dataclass(frozen=True)
class AcceptedEffect:
    """An effect that was taken into the model.

    Attributes:
        score: of the leader, with its settings tuned.
        seat: joints that carry its gain, from 0.
        gains: per joint [nats per sample], shape (n,).
        explained: squared residual that it removed per joint [N^2 m^2], shape (n,).
        held_out: predicted gain on each fold, fitted on the others.
        rivals: scores that cannot be told from it.
        forms: its other forms that explain nearly as much, tuned.
        next_best: best other family at the same joints, or None.
        certainty: log-likelihood by which it beats that one.
    """

    score: Score
    seat: tuple[int, ...]
    gains: Array
    explained: Array
    held_out: tuple[float, ...]
    rivals: tuple[Score, ...]
    next_best: Score | None
    certainty: float
    forms: tuple[Score, ...] = ()

    @property
    def hypothesis(self) -> Candidate:
        """What it is."""
        return self.score.hypothesis


@dataclass(frozen=True)
class Criterion:
    """What an effect must show.

    Attributes:
        threshold: of its gain.
        noise: of each joint while it slides [N m], shape (n,), or None where no repeat tells.
    """

    threshold: Threshold
    noise: Array | None


def main_joints(score: Score, before: Fit) -> tuple[int, ...]:
    """The joints that carry a score's gain, from 0."""
    gains = score.fit.gains_over(before)
    return tuple(int(j) for j in np.flatnonzero(gains >= _SEAT * max(gains.max(), 1e-12)))


def next_effects(
    rows: WindowedRows,
    present: CurrentFit,
    hypotheses: Sequence[Candidate],
    asked: Criterion,
    found: Sequence[AcceptedEffect],
) -> tuple[list[AcceptedEffect], list[Score]]:
    """The next effect that may be believed (with the same one at other joints), and all scores."""
    table, scores = examine(rows, present, hypotheses)
    before = present.fit
    blocked: set[int] = set()
    for score in scores:
        if score.penalised_gain < min(asked.threshold.gain.values()):
            break
        seat = main_joints(score, before)
        if blocked & set(seat):
            continue
        if _believable(score, before, asked.threshold, found) and _more_than_form(
            rows, present, table, score, found, asked.noise
        ):
            there = _where_it_holds(rows, present, table, score)
            if there is None and not blocked:
                pair = try_pair(rows, present, score, hypotheses, asked.threshold, found)
                if pair:
                    return pair, scores
            leader = None if there is None else _found(rows, present, *there, scores)
            if leader is not None and _is_plausible(leader.score):
                alike = _same_effect_on_other_joints(
                    rows, table, present, scores, leader, asked.threshold, found
                )
                return [leader, *alike], scores
        blocked |= set(seat)
    return [], scores


def _where_it_holds(
    rows: WindowedRows, present: CurrentFit, table: Table, score: Score
) -> tuple[Table, Score] | None:
    """An effect that holds on every fold: as it is, or once settings that were far off are met."""
    if holds(table, score, present.fit):
        return table, score
    tuned = refine_nonlinear_parameters(rows, present, score)[0]
    if tuned.gain < _FAR_OFF * score.gain:
        return None
    table, scores = examine(rows, present, [tuned.hypothesis])
    return (table, scores[0]) if scores and holds(table, scores[0], present.fit) else None


def try_pair(
    rows: WindowedRows,
    present: CurrentFit,
    score: Score,
    hypotheses: Sequence[Candidate],
    threshold: Threshold,
    found: Sequence[AcceptedEffect],
) -> list[AcceptedEffect]:
    """An effect that holds nowhere alone, and another one at its seat, beside which both do.

    Two effects of one joint may each spoil what the other one would show.
    """
    seat = set(main_joints(score, present.fit))
    near = [h for h in hypotheses if seat & set(h.joints) and h.effect != score.hypothesis.effect]
    with_first = extend(rows, present, [score.hypothesis])
    second = _best_beside(rows, with_first, near, threshold, found)
    if second is None or second.score.gain < score.gain:
        return []
    with_second = extend(rows, present, [second.hypothesis])
    again = [score.hypothesis, *(h for h in near if h.effect != second.hypothesis.effect)]
    first = _best_beside(rows, with_second, again, threshold, found)
    if first is None or first.hypothesis.effect != score.hypothesis.effect:
        return []
    return [first, second]


def _best_beside(
    rows: WindowedRows,
    present: CurrentFit,
    hypotheses: Sequence[Candidate],
    threshold: Threshold,
    found: Sequence[AcceptedEffect],
) -> AcceptedEffect | None:
    """The best effect beside a model, if it may be believed and holds."""
    table, scores = examine(rows, present, hypotheses)
    best = scores[0] if scores else None
    if best is None or not _believable(best, present.fit, threshold, found):
        return None
    there = _where_it_holds(rows, present, table, best)
    leader = None if there is None else _found(rows, present, *there, scores)
    return leader if leader is not None and _is_plausible(leader.score) else None


def _is_plausible(score: Score) -> bool:
    return is_plausible(score.hypothesis, score.fit, True)


def _believable(
    score: Score, before: Fit, threshold: Threshold, found: Sequence[AcceptedEffect]
) -> bool:
    if score.gain < threshold.of(score.hypothesis.effect):
        return False
    sizes = zip(score.values, score.hypothesis.coefficients, strict=True)
    if all(abs(value) < coefficient.min_size for value, coefficient in sizes):
        return False
    return not any(_same(earlier.hypothesis, score.hypothesis) for earlier in found)


def _more_than_form(
    rows: WindowedRows,
    present: CurrentFit,
    table: Table,
    score: Score,
    found: Sequence[AcceptedEffect],
    noise: Array | None,
) -> bool:
    """Whether it explains more than the earlier effects' form may get wrong."""
    seat = main_joints(score, present.fit)
    earlier = [(f.hypothesis, f.seat, f.explained) for f in found]
    suspects = maybe_misspecification(score, present.fit, seat, earlier)
    return (
        not suspects
        or significant_beside(rows, present, table, score, suspects)
        or _all_that_is_missing(rows, present, score, seat, noise)
    )


def _all_that_is_missing(
    rows: WindowedRows,
    present: CurrentFit,
    score: Score,
    seat: tuple[int, ...],
    noise: Array | None,
) -> bool:
    """Whether, tuned, it closes nearly all that is clearly more than noise: no form's error."""
    if noise is None:
        return False
    quiet = np.nan_to_num(noise[list(seat)])
    now = present.fit.sigma[list(seat), Region.SLIDING]
    if not (now > _LOUD * quiet).any():
        return False
    tuned = refine_nonlinear_parameters(rows, present, score)[0].fit.sigma[
        list(seat), Region.SLIDING
    ]
    return bool((tuned**2 - quiet**2 < _LEFT * (now**2 - quiet**2)).all())


def _same(first: Candidate, second: Candidate) -> bool:
    """Whether they differ only in settings that are tuned: a second one is no further effect."""
    if (first.effect, first.joints) != (second.effect, second.joints):
        return False
    effect = catalogue()[first.effect]
    curve = (
        effect.form_uncertainty is FormUncertainty.SPEED
    )  # over speed: all its forms are tried where it is
    tuned = {s.name for s in effect.nonlinear if not s.discrete or s.refine_only or curve}
    others = fields_of(second.parameters)
    fixed = ((n, v) for n, v in fields_of(first.parameters).items() if n not in tuned)
    return all(others[name] == value for name, value in fixed)


def _found(
    rows: WindowedRows, present: CurrentFit, table: Table, score: Score, scores: Sequence[Score]
) -> AcceptedEffect:
    before = present.fit
    tuned, *forms = refine_nonlinear_parameters(rows, present, score)
    seat = main_joints(score, before)
    near = [
        s
        for s in _best_of_family(scores, score.hypothesis.effect)
        if s.gain > _WORTH_TUNING * score.gain and set(main_joints(s, before)) & set(seat)
    ]
    others = sorted(
        (refine_nonlinear_parameters(rows, present, s)[0] for s in near), key=lambda s: -s.gain
    )
    rows_each = _effective_rows(table, score)
    rivals = tuple(s for s in others if _indistinguishable(tuned, s, before, rows_each))
    best = others[0] if others else None
    certainty = np.inf if best is None else _difference(tuned, best, before, rows_each)
    return AcceptedEffect(
        tuned,
        seat,
        tuned.fit.gains_over(before),
        np.maximum(mean_squares(before) - mean_squares(tuned.fit), 0.0),
        held_out_gains(table, score, before),
        rivals,
        best,
        float(certainty),
        _equivalent_forms(tuned, forms, before, rows_each),
    )


def _equivalent_forms(
    tuned: Score, forms: Sequence[Score], before: Fit, rows_each: Array
) -> tuple[Score, ...]:
    """Forms that explain nearly as much: where the true one is none of them, it may lie between."""
    return tuple(
        s
        for s in forms
        if _difference(tuned, s, before, rows_each) < _SURE or tuned.gain - s.gain < _FORM
    )


def _best_of_family(scores: Sequence[Score], but: str) -> list[Score]:
    best: dict[tuple[str, tuple[int, ...]], Score] = {}
    for s in scores:
        if s.hypothesis.effect != but:
            best.setdefault((s.hypothesis.effect, s.hypothesis.joints), s)
    return list(best.values())


def _effective_rows(table: Table, score: Score) -> Array:
    """Independent rows per joint, shape (n,)."""
    left = residuals(table, score.fit)
    counts = score.fit.counts.sum(axis=1)
    memory = np.array([memory_of(r.values * ~r.apart, r.segment) for r in left])
    return counts / memory


def _difference(leader: Score, rival: Score, before: Fit, rows_each: Array) -> float:
    """Log-likelihood by which the leader beats the rival."""
    better = leader.fit.gains_over(before) - rival.fit.gains_over(before)
    return float(better @ rows_each)


def _indistinguishable(leader: Score, rival: Score, before: Fit, rows_each: Array) -> bool:
    effects = catalogue()
    names = leader.hypothesis.effect, rival.hypothesis.effect
    sure = _difference(leader, rival, before, rows_each) > _SURE
    nested = names[1] in effects[names[0]].contains or names[0] in effects[names[1]].contains
    if nested:
        return False
    alike = names[1] in effects[names[0]].rivals or names[0] in effects[names[1]].rivals
    if alike and leader.gain - rival.gain < _ALIKE:
        return True
    return not sure or rival.gain > _NEAR * leader.gain


def _same_effect_on_other_joints(
    rows: WindowedRows,
    table: Table,
    present: CurrentFit,
    scores: Sequence[Score],
    leader: AcceptedEffect,
    threshold: Threshold,
    found: Sequence[AcceptedEffect],
) -> list[AcceptedEffect]:
    """The same effect at joints of its own, each of which leads there and may be believed."""
    if len(leader.hypothesis.rows) > 1:
        return []
    taken = {leader.hypothesis.joints}
    seats = set(leader.seat)
    alike = []
    for score in scores:
        seat = main_joints(score, present.fit)
        if seats & set(seat):
            continue
        seats |= set(seat)
        same = score.hypothesis.effect == leader.hypothesis.effect
        if not same or score.hypothesis.joints in taken or len(score.hypothesis.rows) > 1:
            continue
        if score.gain < _SAME_SHARE * leader.score.gain:
            continue
        if (
            _believable(score, present.fit, threshold, found)
            and _more_than_form(rows, present, table, score, found, None)
            and holds(table, score, present.fit)
        ):
            taken.add(score.hypothesis.joints)
            tuned, *forms = refine_nonlinear_parameters(rows, present, score)
            gains = tuned.fit.gains_over(present.fit)
            drop = np.maximum(mean_squares(present.fit) - mean_squares(tuned.fit), 0.0)
            held = held_out_gains(table, score, present.fit)
            each = _effective_rows(table, score)
            near = _equivalent_forms(tuned, forms, present.fit, each)
            alike.append(AcceptedEffect(tuned, seat, gains, drop, held, (), None, np.inf, near))
    return alike


def extend_model(
    rows: WindowedRows, present: CurrentFit, found: Sequence[AcceptedEffect]
) -> CurrentFit:
    """The model with some effects."""
    return extend(rows, present, [f.hypothesis for f in found])
