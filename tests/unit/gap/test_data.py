"""Windows, noise regions, and the places where effects are tried."""

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.effects.reversal_friction import SLOW, reversal_speed
from ident.gap.data.experiment import facts_of
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.windows import Windows, windows_for


def test_windows_are_weighted_means_that_overlap_by_half():
    windows = windows_for(500.0, 10.0)
    assert (windows.hop, windows.cutoff_hz) == (25, 10.0)
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(260, 2))
    rows = windows.mean(samples)
    weight = np.sin(np.pi * (np.arange(50) + 0.5) / 50) ** 2
    expected = [weight @ samples[25 * k : 25 * k + 50] / weight.sum() for k in range(9)]
    assert rows == pytest.approx(np.array(expected), abs=1e-12)
    assert windows.least(samples) == pytest.approx(
        np.array([samples[25 * k : 25 * k + 50].min(axis=0) for k in range(9)])
    )
    t = np.arange(260) / 500.0
    assert windows.centres(t) == pytest.approx(25 * np.arange(1, 10) / 500.0)


def test_a_window_with_half_the_cutoff_keeps_half_a_sine():
    windows = Windows(25, 500.0)
    t = np.arange(5000) / 500.0
    rows = windows.mean(np.exp(2j * np.pi * windows.cutoff_hz * t).real[:, None])
    assert np.abs(rows).max() == pytest.approx(0.5, abs=0.02)


def test_regions_tell_turning_sliding_and_turning_of_a_shared_motor():
    windows = Windows(10, 500.0)
    speed = np.column_stack(
        [np.repeat([1.0, 0.0, 1.0, 1.0, 1.0], 10), np.repeat([0.5, 0.5, 1.0, -1.0, 0.5], 10)]
    )
    differential = np.array([[1.0, 1.0], [1.0, -1.0]])
    slow = np.array([0.02, 0.02])
    alone = regions(speed, slow, None, windows)
    assert alone[:, 0].tolist() == [
        Region.REVERSAL,
        Region.REVERSAL,
        Region.SLIDING,
        Region.SLIDING,
    ]
    assert (alone[:, 1] == Region.SLIDING).all()
    shared = regions(speed, slow, differential, windows)
    # the motors turn with q1 + q2 and q1 - q2: each stands still where the speeds are as large
    assert shared[:, 1].tolist() == [
        Region.SLIDING,
        Region.MOTOR_REVERSAL,
        Region.MOTOR_REVERSAL,
        Region.MOTOR_REVERSAL,
    ]
    assert shared[0, 0] == Region.REVERSAL


def test_wide_friction_curves_have_a_wide_slow_region():
    assert reversal_speed(1e-4) == SLOW[0]
    assert reversal_speed(0.02) == pytest.approx(0.03)
    assert reversal_speed(1.0) == SLOW[1]


def test_every_form_of_an_effect_is_tried(source):
    """At once, by a candidate of its own, or late, once the effect leads."""
    for effect in catalogue().values():
        found = effect.candidates(facts_of(source))
        for setting in (s for s in effect.nonlinear if s.discrete and not s.refine_only):
            begun = {h.numbers[setting.name] for h in found if setting.name in h.numbers}
            assert begun == set(setting.grid) or not begun
