"""The torque that a log row tells: the mean from its instant to the next."""

import numpy as np
import pytest

from wamctl.puck import effective_torque
from wamctl.puck.effective_torque import CYCLE_ON_WIRE_S, LATCH_S, TORQUE_FRAME_S, EffectiveTorque


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(effective_torque.time, "monotonic", lambda: now[0])
    return now


def test_a_constant_torque_is_itself(clock):
    torque = EffectiveTorque(7, 0.002, lockstep=False)
    constant = np.arange(7.0)
    for _ in range(3):
        torque.polled()
        clock[0] += 0.0007
        mean = torque.mean(constant)
    assert mean == pytest.approx(constant)


def test_each_frame_arrives_after_the_one_before(clock):
    torque = EffectiveTorque(7, 0.002, lockstep=False)
    torque.mean(np.zeros(7))
    torque.polled()
    clock[0] += 0.0008
    mean = torque.mean(np.ones(7))
    late = 0.0008 - LATCH_S + TORQUE_FRAME_S * np.array([1, 1, 1, 1, 2, 2, 2])
    assert mean == pytest.approx(1.0 - late / 0.002)


def test_a_cycle_that_took_too_long_tells_the_old_torque(clock):
    torque = EffectiveTorque(4, 0.002, lockstep=False)
    torque.mean(np.full(4, 3.0))
    torque.polled()
    clock[0] += 0.01
    assert torque.mean(np.zeros(4)) == pytest.approx(3.0)


def test_lockstep_counts_the_wire_only():
    torque = EffectiveTorque(2, 0.002, lockstep=True)
    torque.mean(np.zeros(2))
    assert torque.mean(np.ones(2)) == pytest.approx(1.0 - CYCLE_ON_WIRE_S / 0.002)


def test_the_impulse_of_a_run_is_kept():
    torque = EffectiveTorque(1, 0.002, lockstep=True)
    sent = np.random.default_rng(1).normal(size=(500, 1))
    told = np.array([torque.mean(t) for t in [*sent, np.zeros(1)]])
    assert told.sum() == pytest.approx(sent.sum())
