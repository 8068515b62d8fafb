"""Blocks of time: each window is of one fold, and what came before a block is not forgotten."""

import numpy as np
import pytest
from closed_loop import nominal_of

from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import FOLDS, blocks_of
from ident.gap.data.windows import body_step, windows_for
from ident.gap.regression.design_matrix import build_design_matrix

JOINT = 3
WAY = 0.2  # rad: blocks begin long before it has been gone


def test_no_window_reaches_from_one_block_into_the_next(source):
    windows = windows_for(500.0, 10.0)
    blocks = blocks_of(source.datasets, windows)
    t = blocks.rows(lambda s: windows.centres(s.t))
    ends = np.flatnonzero(np.diff(blocks.number))
    hop = windows.hop / windows.rate_hz
    assert len(ends) == 8
    np.testing.assert_allclose(np.diff(t)[ends], 2 * hop)
    np.testing.assert_allclose(np.delete(np.diff(t), ends), hop)
    np.testing.assert_array_equal(blocks.fold, blocks.number % FOLDS)


def test_a_bristle_does_not_come_to_rest_where_a_block_begins(source):
    rows, nominal = nominal_of(source)
    effect = catalogue()["presliding"]
    bristle = effect.at((JOINT,), effect.Parameters(WAY), "slip")
    design = build_design_matrix(rows, nominal.model, (), [bristle])
    (whole,) = rows.segments
    state, states = 0.0, [0.0]
    for step in np.diff(whole.q[:, JOINT]):
        state = min(max(state + step / WAY, -1.0), 1.0)
        states.append(state)
    means = rows.windows.mean(np.array(states))
    centres = rows.windows.centres(whole.t)
    expected = means[np.isin(centres, design.t)]
    np.testing.assert_allclose(design.effect_columns(0, JOINT)[:, 0], expected, atol=1e-9)


@pytest.mark.parametrize("rate", [499.98, 500.0, 500.02])
def test_a_rate_that_is_a_little_off_changes_nothing(rate):
    assert body_step(windows_for(rate, 10.0)) == 5
