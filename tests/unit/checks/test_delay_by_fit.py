"""Torque that only the leftover of a fit shows to be out of time."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from wrong_inputs import late, right

from ident.checks.recorder_faults.delay import late_by_fit
from ident.checks.settings import DEFAULT
from ident.gap.data.experiment import of_arm
from ident.gap.options import Options
from ident.identification.torque_delay import Delay
from ident.workflows.gap import gap_of, late_beside
from ident.workflows.run import run_data


def low_pass(x, seconds, rate_hz):
    a = np.exp(-1.0 / (rate_hz * seconds))
    return lfilter([1 - a], [1, -a], x, axis=0)


def filtered(filtered_s):
    """Torque behind a filter, beside a slow torque that is no arm's.

    Positions behind one, where the time is negative.
    """
    log = right(joints=3, seconds=80.0)
    rate_hz = 1.0 / np.median(np.diff(log.t))
    torque = low_pass(log.tau - log.tau[0], max(filtered_s, 1e-6), rate_hz) + log.tau[0]
    log = log.with_(q=low_pass(log.q - log.q[0], max(-filtered_s, 1e-6), rate_hz) + log.q[0])
    slow = np.random.default_rng(0).normal(size=log.tau.shape)
    for _ in range(2):
        slow = low_pass(slow, 4.0, rate_hz)
    return log.with_(tau=torque + 0.35 * log.tau.std(axis=0) * slow / slow.std(axis=0))


def run(log):
    return run_data(log.arm(), [log.dataset(log.arm())])


def searched(log):
    source = of_arm(log.arm(), None, [log.recording()], ["log"])
    return gap_of(source, Options(null_runs=0), lambda *told: None)


def delays_told(done):
    return [r["sentence"] for r in done.content["remarks"] if r["code"] == "late_torque"]


@pytest.mark.parametrize("command", [run, searched])
def test_filtered_torque_is_told_by_a_run_and_by_a_search(command):
    (said,) = delays_told(command(filtered(0.13)))
    assert "lags the motion by about 0.12 s" in said
    assert "as torque that was filtered alone does" in said
    assert delays_told(command(filtered(1e-6))) == []


def test_a_run_tells_filtered_positions():
    """A filter delays: torque leads where it was the positions that passed one."""
    (said,) = delays_told(run(filtered(-0.13)))
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


def noisy(samples):
    """Torque that is late by some samples of 10 ms."""
    log, rng = late(samples, joints=3, seconds=30.0), np.random.default_rng(1)
    return log.with_(tau=log.tau + rng.normal(scale=0.05, size=log.tau.shape))


@pytest.mark.parametrize("samples", [0, 1])
@pytest.mark.parametrize("command", [run, searched])
def test_a_sample_of_10_ms_that_no_check_sees_is_told(command, samples):
    assert len(delays_told(command(noisy(samples)))) == samples


def test_a_search_says_what_to_set_unless_it_has_named_the_delay():
    found = run(noisy(1))
    evidence = found.found.evidence
    (said,) = late_beside(evidence, found.model, [])
    assert said.advice.startswith("Set delay_s: -0.007")
    (said_beside,) = late_beside(evidence, found.model, [], -0.02)
    assert said_beside.advice.startswith("Set delay_s: -0.027")
    assert late_beside(evidence, found.model, [said]) == []
    effects: Any = SimpleNamespace(records=(SimpleNamespace(name="torque_delay"),))
    assert late_beside(evidence, replace(found.model, effects=effects), []) == []
