"""Computed torque (47) against Pinocchio's own forward dynamics, and the error dynamics of (48)."""

import numpy as np
import pinocchio as pin
import pytest

from wamctl.arm.control import Setpoint, computed_torque

ZERO = np.zeros(7)


def chance(seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, 7), rng.uniform(-1, 1, 7), rng.uniform(-1, 1, 7)


@pytest.mark.parametrize("seed", range(3))
def test_on_the_reference_the_arm_accelerates_as_the_reference(wam, seed):
    q, qd, qdd = chance(seed)
    tau = wam.control.torque(q, qd, Setpoint(q, qd, qdd))
    model = wam.robot.model
    assert pin.aba(model, wam.robot.data(), q, qd, tau) == pytest.approx(qdd, abs=1e-9)


def test_an_error_dies_out_critically_damped(wam):
    """e(t) = e0 (1 + w t) exp(-w t), for an arm that is exactly the model."""
    control = computed_torque(
        wam.robot,
        wam.file.controller.model_copy(update={"bandwidth_rad_s": (10.0,) * 7}),
    )
    model, data, h = wam.robot.model, wam.robot.data(), 1e-4
    goal = Setpoint(np.array([0.1, -0.5, 0.2, 1.0, 0.1, 0.2, 0.3]), ZERO, ZERO)
    q, qd = goal.q - 0.1, ZERO.copy()
    for _ in range(2000):
        qd = qd + h * pin.aba(model, data, q, qd, control.torque(q, qd, goal))
        q = q + h * qd
    assert goal.q - q == pytest.approx(0.1 * 3 * np.exp(-2.0) * np.ones(7), rel=2e-3)


def test_release_holds_first_and_damps_last(wam):
    q, qd, _ = chance(4)
    gravity = pin.computeGeneralizedGravity(wam.robot.model, wam.robot.data(), q)
    assert wam.control.release(q, ZERO, 1.0) == pytest.approx(gravity)
    assert wam.control.release(q, ZERO, 0.0) == pytest.approx(ZERO, abs=1e-9)
    assert wam.control.release(q, qd, 0.0) @ qd < 0.0
