"""A load that comes or goes while the arm is recorded."""

import re

import numpy as np
import pytest
from chain_arm import Experiment
from wrong_inputs import carried

from ident.checks.examine import examine


def told(log):
    arm = log.arm()
    remarks = examine(arm, [log.dataset(arm)]).remarks
    return [r.finding for r in remarks if r.code == "load_changes"]


@pytest.mark.parametrize(
    ("mass", "start", "end"), [(1.0, 0.4, 1.1), (2.0, 0.3, 0.6), (0.5, 0.6, 1.1)]
)
def test_when_and_how_much_are_told(mass, start, end):
    (found,) = told(carried(mass, start, end))
    numbers = [float(x) for x in re.findall(r"(\d[\d.]*)", found)]
    assert numbers[0] == pytest.approx(20.0 * start, abs=1.2)
    if end < 1.0:
        assert numbers.pop(1) == pytest.approx(20.0 * end, abs=1.2)
    assert numbers[1] == pytest.approx(mass, rel=0.15)
    assert "kg more" in found


def test_one_that_is_put_down_is_less():
    (found,) = told(carried(1.0, 0.0, 0.5))
    assert "1 kg less" in found


def test_a_drive_that_warms_up_carries_nothing():
    log = Experiment(joints=4, seconds=20.0).log()
    share = log.t / log.t[-1]
    velocity = np.gradient(log.q, log.t, axis=0)
    friction = (share > 0.5)[:, None] * 3.0 * np.tanh(velocity / 0.05)
    assert told(log.with_(tau=log.tau + friction)) == []


def test_nor_does_a_torque_that_jumps_at_one_joint():
    log = Experiment(joints=4, seconds=20.0).log()
    tau = log.tau.copy()
    tau[log.t > 10.0, 1] += 5.0
    assert told(log.with_(tau=tau)) == []
