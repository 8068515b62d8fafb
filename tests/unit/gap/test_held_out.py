"""An effect must hold on every part of the data that can speak of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import HELD_OUT
from ident.gap.regression.current_model import extend, nominal_fit
from ident.gap.regression.rows import ColumnCache
from ident.gap.results.held_out_error import (
    Errors,
    before_and_after,
    below_the_error,
    held_out,
)
from ident.gap.selection.candidates import examine
from ident.gap.selection.cross_validation import excites, fold_gains, passes_cross_validation
from ident.gap.settings import CrossValidation, Scoring

JOINT = 3
SIZE = 3.0  # N m/rad


def sprung(search, folds, until=np.inf, noise=0.0):
    """Design matrix and score of a spring that acts in some folds, up to some time.

    The held-out fold is as noisy [N m] as told at the spring's joint.
    """
    facts = search.start.model.facts
    hypotheses = catalogue()["joint_spring"].candidates(facts)
    spring = next(h for h in hypotheses if h.joints == (JOINT,))
    rows = replace(search.rows, cache=ColumnCache())
    where = np.isin(rows.blocks.fold, folds)
    current = nominal_fit(rows, facts)
    extend(rows, current, [spring])
    for key, columns in list(rows.cache.columns.items()):
        if spring.key == key[: len(spring.key)]:
            rows.cache.columns[key] = columns * where[:, None, None]
    q = rows.blocks.means(lambda s: s.q)[:, JOINT]
    torque = rows.torque.copy()
    torque[:, JOINT] += SIZE * (where & (rows.t < until)) * (q - q.mean())
    loud = rows.blocks.fold == HELD_OUT
    torque[loud, JOINT] += noise * np.random.default_rng(0).normal(size=loud.sum())
    rows = replace(rows, torque=torque)
    current = nominal_fit(rows, facts)
    design, scores = examine(rows, current, [spring], Scoring())
    return design, scores[0], current.fit


@pytest.mark.parametrize("folds", [(0, 1, 2), (0,)])
def test_an_effect_that_acts_wherever_it_can_holds(nothing_hidden, folds):
    design, score, before = sprung(nothing_hidden, folds)
    assert [
        f for f in range(3) if excites(design, score.index, before, f, CrossValidation())
    ] == list(folds)
    assert passes_cross_validation(design, score, before, CrossValidation())


def test_an_effect_that_acts_in_a_part_of_the_only_fold_that_knows_it_does_not_hold(
    nothing_hidden,
):
    design, score, before = sprung(nothing_hidden, (0,), until=6.0)
    assert not passes_cross_validation(design, score, before, CrossValidation())


def test_an_effect_that_only_a_part_of_the_motion_shows_does_not_hold(nothing_hidden):
    design, score, before = sprung(nothing_hidden, (0, 1, 2), until=20.0)
    assert all(excites(design, 0, before, f, CrossValidation()) for f in range(3))
    assert not passes_cross_validation(design, score, before, CrossValidation())


def test_a_fold_that_is_noisy_asks_no_more_of_an_effect_than_it_can_gain_there(nothing_hidden):
    design, score, before = sprung(nothing_hidden, (0, 1, 2), noise=3.0)
    *quiet, noisy = fold_gains(design, score, before, CrossValidation())
    assert noisy.own < 0.2 * min(g.own for g in quiet)
    assert noisy.carried == pytest.approx(noisy.own, rel=0.1)
    assert passes_cross_validation(design, score, before, CrossValidation())


@pytest.mark.parametrize(
    ("floor", "told"), [(0.8, 0.8), (1.1, 1.0), (1.5, None)], ids=["below", "chance", "above"]
)
def test_a_noise_floor_does_not_lie_above_the_error(floor, told):
    """What repeats may be no repeat of the motion at all: the difference is no noise then."""
    errors = [Errors(percent, np.array([percent])) for percent in (floor, 1.0)]
    found = below_the_error(*errors, chance_ratio=1.3)
    assert (found and found.relative_percent) == told


def test_what_keeps_its_structure_is_a_part_of_the_gap_that_is_not_closed(nothing_hidden):
    """A gap of one joint is closed, and another joint keeps one of the same size."""
    found = nothing_hidden
    quiet = before_and_after(found, found.start.fit.x, found.end.fit.x)
    sigma = found.end.fit.sigma
    loud = [replace(r, values=9.0 * sigma[j][r.region]) for j, r in enumerate(quiet.after)]
    other = 1
    both = replace(
        quiet,
        before=[loud[j] if j in (JOINT, other) else r for j, r in enumerate(quiet.before)],
        after=[loud[j] if j == other else r for j, r in enumerate(quiet.after)],
    )
    effect = SimpleNamespace(joints=(JOINT,))
    left = SimpleNamespace(structure=SimpleNamespace(joint=other))

    def closed(*unexplained):
        verdict = replace(found.verdict, effects=(effect,), unexplained=unexplained)
        return held_out(replace(found, verdict=verdict), both).closed

    assert closed() > 0.9
    assert 0.3 < closed(left) < 0.7
