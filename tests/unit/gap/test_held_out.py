"""An effect must hold on every part of the data that can speak of it."""

from dataclasses import replace

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.gap.regression.current_model import examine, extend, nominal_fit
from ident.gap.selection.cross_validation import excites, holds

JOINT = 3
SIZE = 3.0  # N m/rad


def sprung(search, folds, until=np.inf):
    """Table and score of a spring that some folds know, with its torque up to some time in them."""
    facts = search.start.model.facts
    hypotheses = catalogue()["joint_spring"].candidates(facts)
    spring = next(h for h in hypotheses if h.joints == (JOINT,))
    rows = replace(search.rows, formed={})
    present = nominal_fit(rows, facts)
    extend(rows, present, [spring])
    for key, columns in rows.formed.items():
        if spring.key == key[1 : 1 + len(spring.key)] and rows.segments[key[0]].fold not in folds:
            rows.formed[key] = 0.0 * columns
    torque = []
    for s, y in zip(rows.segments, rows.torque, strict=True):
        there = (s.fold in folds) & (rows.windows.centres(s.t)[: len(y)] < until)
        q = rows.windows.mean(s.q)[: len(y), JOINT]
        added = y.copy()
        added[:, JOINT] += SIZE * there * (q - search.rows.segments[0].q[:, JOINT].mean())
        torque.append(added)
    rows = replace(rows, torque=tuple(torque))
    present = nominal_fit(rows, facts)
    table, scores = examine(rows, present, [spring])
    return table, scores[0], present.fit


@pytest.mark.parametrize("folds", [(0, 1, 2), (0,)])
def test_an_effect_that_acts_wherever_it_can_holds(nothing_hidden, folds):
    table, score, before = sprung(nothing_hidden, folds)
    assert [f for f in range(3) if excites(table, score.index, before, f)] == list(folds)
    assert holds(table, score, before)


def test_an_effect_that_acts_in_a_part_of_the_only_fold_that_knows_it_does_not_hold(
    nothing_hidden,
):
    table, score, before = sprung(nothing_hidden, (0,), until=6.0)
    assert not holds(table, score, before)
