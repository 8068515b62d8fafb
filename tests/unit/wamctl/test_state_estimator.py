"""Position and velocity from readings."""

import numpy as np
import pytest

from wamctl.arm.transmission import Transmission
from wamctl.drives.interface import Readings
from wamctl.safety.state_estimator import StateEstimator

PERIOD_S = 0.002
GEAR = np.array([[10.0, 0.0], [5.0, 5.0]])


def readings(angle, missing=()):
    angle = np.array(angle, dtype=float)
    angle[list(missing)] = np.nan
    return Readings(angle, tuple(missing), True, False, None)


@pytest.fixture
def estimator():
    return StateEstimator(Transmission(GEAR, np.linalg.inv(GEAR)), 40.0, np.zeros(2))


def test_before_the_first_cycle_the_arm_rests(estimator):
    assert estimator.state.q == pytest.approx([0.0, 0.0])
    assert estimator.state.qd == pytest.approx([0.0, 0.0])


def test_a_steady_motion_is_seen_as_it_is(estimator):
    speed = GEAR @ np.array([0.3, -0.2])
    for k in range(1, 200):
        state = estimator.update(readings(speed * k * PERIOD_S), PERIOD_S)
    assert state.qd == pytest.approx([0.3, -0.2])
    assert state.q == pytest.approx(np.array([0.3, -0.2]) * 199 * PERIOD_S)


@pytest.mark.parametrize("frequency_hz", [5.0, 40.0])
def test_velocity_is_filtered_as_configured(estimator, frequency_hz):
    """First-order low-pass: gain 1 / sqrt(1 + (f / fc)^2), -3 dB at the cut-off."""
    t = np.arange(0, 2.0, 1e-4)  # fast sampling, so that the filter is as good as continuous
    speeds = []
    for instant in t:
        angle = GEAR @ np.array([1.0, 0.0]) * np.sin(2 * np.pi * frequency_hz * instant)
        speeds.append(estimator.update(readings(angle), 1e-4).qd[0])
    peak = np.abs(speeds[len(speeds) // 2 :]).max() / (2 * np.pi * frequency_hz)
    assert peak == pytest.approx(1 / np.sqrt(1 + (frequency_hz / 40.0) ** 2), rel=0.02)


def test_a_missing_reading_is_extrapolated_and_marked(estimator):
    speed = np.array([2.0, 1.0])
    for k in range(1, 500):
        estimator.update(readings(speed * k * PERIOD_S), PERIOD_S)
    state = estimator.update(readings(speed, missing=(1,)), PERIOD_S)
    assert not state.complete
    assert state.angle_motor[1] == pytest.approx(500 * PERIOD_S)
    assert np.isfinite(state.q).all()
    assert estimator.update(readings(speed * 501 * PERIOD_S), PERIOD_S).complete


def test_a_cycle_that_came_late_does_not_look_fast(estimator):
    speed = np.array([2.0, 1.0])
    for k in range(1, 500):
        estimator.update(readings(speed * k * PERIOD_S), PERIOD_S)
    state = estimator.update(readings(speed * 508 * PERIOD_S), 9 * PERIOD_S)
    assert GEAR @ state.qd == pytest.approx(speed)
