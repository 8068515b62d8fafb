"""Torque that comes later than the motion: by how much, and how sure that is."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.examine import examine
from ident.checks.recorder_faults.delay import Lag, agreed
from ident.checks.remark import Remark
from ident.checks.settings import DEFAULT


@pytest.mark.parametrize("late", [0.035, 0.04, 0.075, 0.12, 0.2, 0.37])
def test_a_delay_between_those_that_are_tried_is_told_as_it_is(late: float) -> None:
    """Through three coarse points the parabola lay 4 to 10 ms off, from 0.2 s on up to 0.28 s."""
    told = late_torque(late)
    seconds = float(told.finding.split("about ")[1].split(" s")[0])
    assert seconds == pytest.approx(late, abs=1.5e-3 + 0.02 * late)


@pytest.mark.parametrize("known_s", [-0.15, 0.05])
def test_the_advice_counts_the_delay_that_is_set_already(known_s: float) -> None:
    """The rest was told as what to set: who followed it went round in circles."""
    told = late_torque(0.2, delay_s=known_s)
    advised = float(told.advice.split("delay_s: ")[1].split(" in the")[0])
    assert advised == pytest.approx(-0.2, abs=0.006)


def late_torque(late: float, **settings: float) -> Remark:
    """What is said of torque that was recorded so much later than the motion."""
    log = Experiment(joints=4, seconds=30.0).log()
    tau = np.stack([np.interp(log.t - late, log.t, course) for course in log.tau.T], axis=1)
    moved = log.with_(tau=tau)
    arm = moved.arm().with_settings(**settings)
    (told,) = (r for r in examine(arm, [moved.dataset(arm)]).remarks if r.code == "late_torque")
    return told


def test_a_delay_is_sure_only_where_sliding_and_all_instants_agree() -> None:
    """Each of the two may be sure of itself: 0.036 s was told with an error of 0.02 s."""
    sliding = Lag(None, 0.036, 0.002, 0.7, 0.7)
    for seconds, sure in ((0.037, True), (0.056, False)):
        both = agreed(sliding, Lag(None, seconds, 0.002, 0.7, 0.7))
        assert both.seconds == sliding.seconds
        assert both.borne_out(DEFAULT) is sure
