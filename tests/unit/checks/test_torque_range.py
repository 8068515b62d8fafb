"""Where a torque ends: at the end of its range, or at the last of its coarse steps."""

import numpy as np
import pytest
from chain_arm import Experiment, Log
from wrong_inputs import clipped

from ident.checks.examine import examine
from ident.checks.recorder_faults.torque_range import _ends
from ident.checks.settings import DEFAULT

COURSE = np.sin(np.linspace(0.0, 40.0, 4000))


def test_a_torque_that_is_cut_off_ends_there() -> None:
    assert _ends([np.clip(COURSE, -0.9, 0.8)], DEFAULT) == [-0.9, 0.8]


@pytest.mark.parametrize("step", [0.005, 0.02])
def test_the_last_of_coarse_steps_is_no_end(step: float) -> None:
    """It is hardly more often there than at the step before."""
    assert _ends([np.round(COURSE / step) * step], DEFAULT) == []


def test_a_torque_in_coarse_steps_is_cut_off_as_well() -> None:
    stepped = np.round(np.clip(COURSE, -0.5, 0.5) / 0.005) * 0.005
    assert _ends([stepped], DEFAULT) == pytest.approx([-0.5, 0.5])


def test_a_torque_that_never_changes_has_no_end() -> None:
    assert _ends([np.zeros(100)], DEFAULT) == []


def test_of_a_torque_that_is_nearly_all_cut_off_few_values_are_left_but_no_coarse_steps() -> None:
    assert _ends([np.clip(COURSE[::4], -0.05, 0.05)], DEFAULT) == [-0.05, 0.05]


def test_a_torque_that_switches_from_one_end_to_the_other_is_not_cut_off() -> None:
    between = np.linspace(-0.8, 0.8, 200)
    switched = np.where(np.arange(4000) // 5 % 2, 0.9, -0.9)
    assert _ends([np.concatenate([switched, between])], DEFAULT) == []


def told_of(log: Log) -> dict[str, tuple[int, ...]]:
    """Codes of what the checks say, each with its joints."""
    arm = log.arm()
    return {r.code: r.joints for r in examine(arm, [log.dataset(arm)]).remarks}


@pytest.mark.parametrize("share", [0.5, 0.3, 0.1, 0.02])
def test_heavy_clipping_is_told_at_each_joint(share: float) -> None:
    """Up to nearly all samples lie at the two ends: the rest was thought too little to go by."""
    assert told_of(clipped(share))["torque_range"] == (1, 2, 3)


def test_a_share_of_the_motion_and_the_end_that_is_reached_are_told() -> None:
    log = Experiment().log()
    end = np.quantile(log.tau[:, 1], 0.4)
    at_second = np.arange(3) == 1
    log = log.with_(tau=np.where(at_second, np.maximum(log.tau, end), log.tau))
    arm = log.arm()
    (told,) = (r for r in examine(arm, [log.dataset(arm)]).remarks if r.code == "torque_range")
    assert f"({abs(end):.3g} N m at joint 2, for 39 % of its motion)" in told.finding


def test_a_torque_that_keeps_one_sign_and_is_nearly_all_cut_off_is_no_constant() -> None:
    """A constant leaves little of it, but all of what varies."""
    log = Experiment(joints=4).log()
    at_second = np.arange(4) == 1
    lifted = log.tau + at_second * 4.0 * np.abs(log.tau).max(axis=0)
    cut = np.where(at_second, np.minimum(lifted, np.quantile(lifted, 0.2, axis=0)), lifted)
    for tau, told in ((lifted, False), (cut, True)):
        arm = log.arm()
        remarks = examine(arm, [log.with_(tau=tau).dataset(arm)]).remarks
        assert any("it is clipped" in r.finding for r in remarks) == told


def test_friction_that_stands_at_two_values_is_not_cut_off() -> None:
    """Most of its samples lie at the ends, but friction explains them."""
    for joints in (1, 3):
        log = Experiment(joints=joints, seconds=20.0, noise=0.0, friction=0.0).log()
        speed = np.gradient(log.q, log.t, axis=0)
        assert "torque_range" not in told_of(log.with_(tau=5.0 * np.tanh(speed / 0.01)))


def test_clipped_torque_is_no_current() -> None:
    """It is far too small for the URDF's links, since what is missing was cut off."""
    log = Experiment(joints=4).log()
    most = np.where(np.arange(4) == 1, 0.1, 1.0) * np.abs(log.tau).max(axis=0)
    told = told_of(log.with_(tau=np.clip(log.tau, -most, most)))
    assert told["torque_range"] == (2,)
    assert "current_not_torque" not in told
