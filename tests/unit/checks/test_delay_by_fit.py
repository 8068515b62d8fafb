"""Torque that only the leftover of a fit shows to be out of time."""

import numpy as np
import pytest
from scipy.signal import lfilter
from wrong_inputs import late, right

from ident.checks.recorder_faults.delay import late_by_fit
from ident.checks.settings import DEFAULT
from ident.identification.torque_delay import Delay
from ident.workflows.run import run_data


def low_pass(x, seconds, rate_hz):
    a = np.exp(-1.0 / (rate_hz * seconds))
    return lfilter([1 - a], [1, -a], x, axis=0)


def delays_told(filtered_s):
    """What a run says of torque behind a filter, beside a slow torque that is no arm's.

    Of positions, where the time is negative.
    """
    log = right(joints=3, seconds=80.0)
    rate_hz = 1.0 / np.median(np.diff(log.t))
    torque = low_pass(log.tau - log.tau[0], max(filtered_s, 1e-6), rate_hz) + log.tau[0]
    log = log.with_(q=low_pass(log.q - log.q[0], max(-filtered_s, 1e-6), rate_hz) + log.q[0])
    slow = np.random.default_rng(0).normal(size=log.tau.shape)
    for _ in range(2):
        slow = low_pass(slow, 4.0, rate_hz)
    one = log.with_(tau=torque + 0.35 * log.tau.std(axis=0) * slow / slow.std(axis=0))
    remarks = run_data(one.arm(), [one.dataset(one.arm())]).content["remarks"]
    return [r["sentence"] for r in remarks if r["code"] == "late_torque"]


def test_a_run_tells_filtered_torque():
    (said,) = delays_told(0.13)
    assert "lags the motion by about 0.12 s" in said
    assert "as torque that was filtered alone does" in said
    assert delays_told(1e-6) == []


def test_a_run_tells_filtered_positions():
    """A filter delays: torque leads where it was the positions that passed one."""
    (said,) = delays_told(-0.13)
    assert "leads the motion by about 0.1" in said
    assert "as where positions were filtered alone" in said


@pytest.mark.parametrize(
    ("seconds", "way", "why", "advice"),
    [
        (-0.1, "lags", "as torque that was filtered alone does", "Record the torque"),
        (0.08, "leads", "as where positions were filtered alone", "Record positions"),
    ],
)
def test_filtered_torque_is_told(seconds, way, why, advice):
    (remark,) = late_by_fit(Delay(seconds, 0.008), "log", DEFAULT)
    assert f"{way} the motion by about {abs(seconds):g} s" in remark.finding
    assert why in remark.finding
    assert remark.advice.startswith(advice)


@pytest.mark.parametrize(("seconds", "sd"), [(-0.009, 0.0018), (0.08, 0.03), (0.0, 0.0)])
def test_what_a_model_lacks_is_no_delay(seconds, sd):
    assert late_by_fit(Delay(seconds, sd, 0.06), "log", DEFAULT) == []


def test_a_short_one_is_told_by_what_it_explains():
    (remark,) = late_by_fit(Delay(-0.007, 0.0001, 0.72), "log", DEFAULT)
    assert "72 % of the squares" in remark.finding
    assert "lags the motion by about 0.007 s" in remark.finding
    assert late_by_fit(Delay(0.0008, 0.00001, 0.6), "log", DEFAULT) == []
    assert late_by_fit(Delay(-0.007, 0.002, 0.72), "log", DEFAULT) == []


@pytest.mark.parametrize("samples", [0, 1])
def test_a_run_tells_a_sample_of_10_ms_that_no_check_sees(samples):
    log = late(samples, joints=3, seconds=30.0)
    data = log.with_(tau=log.tau + np.random.default_rng(1).normal(scale=0.05, size=log.tau.shape))
    found = run_data(data.arm(), [data.dataset(data.arm())])
    told = [r["sentence"] for r in found.content["remarks"] if r["code"] == "late_torque"]
    assert len(told) == samples
