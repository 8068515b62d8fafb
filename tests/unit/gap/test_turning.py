"""Mixtures of reversal curves: what they can follow, and what they cannot."""

import numpy as np
import pytest
from scipy.special import erf

from ident.effects.reversal_friction import (
    BASIS,
    USUAL,
    MaxwellSlipMixture,
    SmoothedSign,
    best_mixture,
    parts_of,
)
from ident.effects.smoothed_segment import DIRECTION_HZ

T = np.linspace(0.0, 20.0, 4000)
Q = 0.3 * np.sin(0.7 * T) + 0.1 * np.sin(2.3 * T)
SPEED = 0.21 * np.cos(0.7 * T) + 0.23 * np.cos(2.3 * T)
SPEEDS = np.tile(SPEED, (len(DIRECTION_HZ), 1))
COLUMNS = np.column_stack([t(Q, SPEEDS) for t in BASIS])


def mixed(target: np.ndarray) -> tuple[MaxwellSlipMixture, float]:
    """The best mixture for a friction torque, and the largest error relative to its rms."""
    weights, gain = best_mixture(COLUMNS.T @ COLUMNS, COLUMNS.T @ target)
    assert (weights >= 0.0).all()
    rest = target - COLUMNS @ weights
    assert gain == pytest.approx((target @ target - rest @ rest) / 2, rel=1e-4)
    return MaxwellSlipMixture(parts_of(weights, USUAL)), float(
        np.sqrt(np.mean(rest**2) / np.mean(target**2))
    )


@pytest.mark.parametrize("width", [0.004, 0.009])
@pytest.mark.parametrize("form", [np.tanh, erf])
def test_every_curve_that_rises_ever_slower_is_a_mixture(form, width):
    _, error = mixed(0.7 * form(SPEED / width))
    assert error < 0.02


def test_friction_that_never_quite_ends_its_turn_is_one():
    mixture, error = mixed(0.7 * np.arctan(SPEED / 0.003))
    assert error < 0.005
    assert mixture.width > 0.02


@pytest.mark.parametrize("width", [0.004, 0.012])
def test_a_tail_that_falls_as_one_over_speed_is_no_drag(width):
    _, error = mixed(0.7 * SPEED / (width + np.abs(SPEED)))
    assert error < 0.003


def test_drag_that_rises_as_a_root_of_speed_is_none():
    _, error = mixed(np.sign(SPEED) * (1.0 + 2.0 * np.abs(SPEED) ** 0.5))
    assert error > 0.05


def test_a_bristle_is_a_mixture_too():
    z = np.zeros_like(Q)
    for i, dx in enumerate(np.diff(Q)):  # Dahl 1968
        ahead = np.sign(dx)
        z[i + 1] = ahead - (ahead - z[i]) * np.exp(-abs(dx) / 3e-4)
    mixture, error = mixed(2.0 * z)
    assert error < 0.02
    assert mixture.width < 0.02


def test_friction_that_falls_with_speed_is_none():
    _, error = mixed(np.tanh(SPEED / 0.004) * (1 + 0.5 * np.exp(-np.abs(SPEED) / 0.08)))
    assert error > 0.05


def test_nearly_all_of_a_mixture_has_turned_at_its_width():
    parts = np.zeros(len(BASIS))
    for part, turning in (
        (0.7, SmoothedSign(0.003, 0)),
        (0.25, SmoothedSign(0.018, 2)),
        (0.05, SmoothedSign(0.035, 2)),
    ):
        parts[BASIS.index(turning)] = part
    mixture = MaxwellSlipMixture(parts)
    assert (mixture.width, mixture.cutoff) == (0.018, 0)
    assert mixture.along(np.array([-1.0, 0.0, 1.0])) == pytest.approx([-1.0, 0.0, 1.0])
    assert mixture(Q, SPEEDS) == pytest.approx(COLUMNS @ parts)
