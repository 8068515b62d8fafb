"""Regression rows: the truth comes back, whatever the windows; parallel filters have no bias."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_arm import motion, recording

import ident.regression.rows
from ident.dynamics.base_parameters import base_map, whole_range
from ident.model.arm import arm_from_file
from ident.recordings.dataset import dataset
from ident.recordings.errors import TooShortError
from ident.regression.filters import highest_frequency, processing
from ident.regression.rows import Regressor, rows_of
from wamctl.arm.errors import DataError


@pytest.fixture(scope="module")
def base(wam):
    return base_map(wam.arm.robot, wam.arm.terms, [whole_range(7)])


def rows(wam, base, log, **settings):
    arm = wam.arm.with_settings(**settings)
    data = dataset(log, arm.robot.joint_names, "log")
    process = processing(arm, data)
    parts = list(rows_of(data, process, Regressor(arm.robot, arm.terms, base, data.moving)))
    return process, [np.concatenate([getattr(p, n) for p in parts]) for n in ("W", "tau", "t")]


def test_without_noise_the_true_parameters_explain_the_torque(wam, base, clean):
    _, (W, tau, _) = rows(wam, base, clean)
    error = np.sqrt(np.mean((tau - W @ (base.K @ wam.delta)) ** 2, axis=0))
    assert (error < 2e-3 * np.sqrt(np.mean(tau**2, axis=0))).all()


def test_rows_do_not_depend_on_the_windows(wam, base, clean, monkeypatch):
    _, whole = rows(wam, base, clean)
    monkeypatch.setattr(ident.regression.rows, "_WINDOW_SAMPLES", 700)
    _, pieces = rows(wam, base, clean)
    for a, b in zip(whole, pieces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


def test_parallel_filtering_leaves_no_bias_where_plain_filtering_leaves_one(wam, base):
    """A fast motion through a slow filter: only what is filtered alike stays equal."""
    _, q, qd, qdd = motion(20.0, 250.0)
    t = np.arange(len(q)) / 250.0
    fast = recording(wam.arm.robot.joint_names, t, q, wam.torque(q, 5 * qd, 25 * qdd))
    faster = replace(fast, stamp_ns=fast.stamp_ns // 5)
    bias = {}
    for parallel in (True, False):
        _, (W, tau, _) = rows(wam, base, faster, cutoff_hz=4.0, filter_torque=parallel)
        shift = np.linalg.lstsq(W.reshape(-1, W.shape[-1]), tau.ravel(), rcond=None)[0]
        shift -= base.K @ wam.delta
        bias[parallel] = np.linalg.norm((W @ shift).ravel()) / np.linalg.norm(tau.ravel())
    assert bias[True] < 0.004
    assert bias[False] > 10 * bias[True]


def test_the_cutoff_is_ten_times_the_highest_harmonic(wam, base, clean):
    process, _ = rows(wam, base, clean)
    assert process.cutoff_hz == pytest.approx(2.5)  # five harmonics of 0.05 Hz
    assert process.columns is not None
    assert (process.motion.cutoff_hz, process.sign.cutoff_hz) == (25.0, 25.0)


def test_a_plain_urdf_takes_its_cutoff_from_the_motion(wam, clean, tmp_path):
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(wam.arm.robot.urdf)
    arm = arm_from_file(urdf, clean.joint_names)
    data = dataset(clean, arm.robot.joint_names, "log")
    assert highest_frequency(data) == pytest.approx(0.25, abs=0.06)
    assert processing(arm, data).cutoff_hz == pytest.approx(2.5, abs=0.6)


def test_too_slow_a_rate_and_too_short_a_log_are_refused(wam, base, clean):
    with pytest.raises(DataError) as caught:
        rows(wam, base, clean, cutoff_hz=120.0)
    assert str(caught.value) == (
        "log has 250 samples a second, too few for a cut-off of 120 Hz: give at most 100 Hz"
        " (--cutoff)."
    )
    short = replace(
        clean, stamp_ns=clean.stamp_ns[:200], q=clean.q[:200], effort=clean.effort[:200]
    )
    with pytest.raises(TooShortError) as caught:
        rows(wam, base, short)
    assert str(caught.value) == (
        "The longest unbroken stretch of log lasts 0.8 s, but a filter with a cut-off of 2.5 Hz"
        " needs 4.07 s. Record for longer,"
        " or raise --cutoff."
    )
