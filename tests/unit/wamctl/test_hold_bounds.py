"""Bounds of a held arm: it may hang beside its reference where it came there by its own motors."""

import numpy as np
import pytest

from wamctl.errors import SafetyStopError
from wamctl.experiment.hold_bounds import HoldBounds
from wamctl.experiment.preflight import load_arm
from wamctl.safety.state_estimator import ArmState
from wamctl.telemetry.status import Phase

THERE = np.array([0.2, 0.07, 0.3, 1.02, -1.7, 0.0, 0.0])
STILL = np.zeros(7)


@pytest.fixture(scope="module")
def arm():
    return load_arm("wam7.yaml")[1]


def check(bounds, q):
    bounds.check(ArmState(q, STILL, STILL, True), THERE, [f"joint {k}" for k in range(1, 8)])


def test_an_arm_that_hangs_when_it_is_first_held_may_hang_on(arm):
    fresh = HoldBounds(arm, THERE, 0.3, Phase.APPROACH)
    sag = np.zeros(7)
    sag[1] = 1.3 * fresh.furthest[1]
    held = HoldBounds(arm, THERE, 0.3, Phase.APPROACH, sag)

    check(held, THERE + sag)
    with pytest.raises(SafetyStopError, match=r"joint 2 went .* while it was held"):
        check(fresh, THERE + sag)


def test_from_there_it_may_go_no_further_than_any_held_arm(arm):
    sag = np.full(7, 0.05)
    held = HoldBounds(arm, THERE, 0.3, Phase.APPROACH, sag)
    away = np.zeros(7)
    away[3] = 1.01 * held.furthest[3]

    with pytest.raises(SafetyStopError, match=r"joint 4 went .* while it was held"):
        check(held, THERE + sag + away)
