"""One joint's torque of another scale is told, and which joint's it is."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.examine import examine

LOG = Experiment(joints=4, noise=0.0).log()


@pytest.mark.parametrize(("joint", "factor"), [(1, 2.0), (2, 2.0), (2, 0.5)])
@pytest.mark.parametrize("share", [0.0, 0.08], ids=["exact", "rough"])
def test_the_joint_whose_torque_is_off(joint: int, factor: float, share: float) -> None:
    rng = np.random.default_rng(joint)
    t, period = LOG.t[:, None], rng.uniform(0.3, 0.6, 4)
    rough = share * LOG.tau.std(axis=0) * np.sign(np.sin(2 * np.pi * t / period))
    tau = (LOG.tau + rough) * np.where(np.arange(4) == joint, factor, 1.0)
    log = LOG.with_(tau=tau)
    arm = log.arm()
    told = [r for r in examine(arm, [log.dataset(arm)]).remarks if r.code == "current_not_torque"]
    assert [r.joints for r in told] == [(joint + 1,)]
    assert f"{factor:g} times as large as the other joints' torques require" in told[0].finding


@pytest.mark.parametrize("joint", [0, 1])
def test_one_joint_in_another_unit_says_nothing_of_the_others(joint: int) -> None:
    """Its size alone made all torques be taken for N mm, and converted."""
    log = LOG.with_(tau=LOG.tau * np.where(np.arange(4) == joint, 1000.0, 1.0))
    arm = log.arm()
    examined = examine(arm, [log.dataset(arm)])
    told = [r for r in examined.remarks if r.code in ("units", "current_not_torque")]
    assert [(r.code, r.joints) for r in told] == [("current_not_torque", (joint + 1,))]
    assert "it is in N mm" in told[0].finding
    (segment,) = examined.data[0].segments
    assert np.abs(segment.tau).max() == np.abs(log.tau).max()
