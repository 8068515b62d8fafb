"""One joint's torque in another unit is told where the URDF has no masses."""

import re

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.examine import examine

LOG = Experiment(joints=4, seconds=40.0).log()
BARE = LOG.with_(urdf=re.sub(r"<inertial>.*?</inertial>", "", LOG.urdf, flags=re.DOTALL))


def told(factors):
    log = BARE.with_(tau=LOG.tau * factors)
    remarks = examine(log.arm(), [log.dataset(log.arm())]).remarks
    return [r for r in remarks if r.code == "current_not_torque"]


@pytest.mark.parametrize(("joint", "factor"), [(3, 1000.0), (2, 1000.0), (2, 0.01)])
def test_the_joint_is_told_with_its_factor(joint, factor):
    (remark,) = told(np.where(np.arange(1, 5) == joint, factor, 1.0))
    assert remark.joints == (joint,)
    size = float(re.search(r"be about (\S+) times as large", remark.finding)[1])
    assert size == pytest.approx(factor, rel=0.3)


def test_right_torque_has_no_odd_joint():
    assert told(np.ones(4)) == []
