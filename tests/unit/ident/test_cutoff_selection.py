"""A cut-off where the velocity is noise up to half the sampling rate."""

from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt
from synthetic_arm import motion, recording

from ident.identification.cutoff_selection import with_best_cutoff
from ident.recordings.dataset import dataset
from ident.regression.filters import processing


def measured(wam, position_noise, swaying=0.0):
    t, q, qd, qdd = motion(20.0, 500.0)
    rng = np.random.default_rng(3)
    noise = np.array([2.0, 2.0, 1.0, 1.0, 0.2, 0.2, 0.1]) * rng.normal(size=q.shape)
    tau = wam.torque(q, qd, qdd) + noise
    seen = q + position_noise * rng.normal(size=q.shape)
    slow = butter(3, 4.0, fs=500.0, output="sos")
    seen += swaying * sosfiltfilt(slow, rng.normal(size=q.shape), axis=0)
    names = wam.arm.robot.joint_names
    return dataset(recording(names, t, seen, tau), names, "log")


def test_noisy_positions_get_the_cutoff_that_explains_the_unfiltered_torque(wam):
    data, unknown = measured(wam, 1e-3), replace(wam.arm, harmonic_hz=None)
    assert processing(unknown, data).cutoff_hz > 90.0
    arm, choice = with_best_cutoff([data], unknown)
    assert choice is not None
    assert arm.settings.cutoff_hz == choice.chosen_hz
    assert 1.0 < choice.chosen_hz < 20.0
    errors = list(choice.errors.values())
    assert choice.errors[choice.chosen_hz] < 0.7 * errors[0]
    assert f"{choice.chosen_hz:.3g} Hz" in choice.sentence


def test_an_encoder_that_sways_gets_a_cutoff_below_that(wam):
    """Its velocity asks for a cut-off that is far from noise, and most of the torque is left."""
    data, unknown = measured(wam, 1e-8, swaying=0.13), replace(wam.arm, harmonic_hz=None)
    assert 20.0 < processing(unknown, data).cutoff_hz < 50.0
    arm, choice = with_best_cutoff([data], unknown)
    assert choice is not None
    assert arm.settings.cutoff_hz == choice.chosen_hz < 0.3 * choice.wanted_hz


def test_a_cutoff_that_the_motion_tells_is_kept(wam):
    unknown = replace(wam.arm, harmonic_hz=None)
    assert with_best_cutoff([measured(wam, 1e-8)], unknown) == (unknown, None)
    assert with_best_cutoff([measured(wam, 1e-3)], wam.arm) == (wam.arm, None)
    given = wam.arm.with_settings(cutoff_hz=7.0)
    assert with_best_cutoff([measured(wam, 1e-3)], given) == (given, None)


def test_the_cutoff_of_a_slow_and_short_motion_lets_its_filter_fit(wam):
    """One slow way in the whole recording asks for a filter that is longer than that."""
    t = np.arange(1500) / 500.0
    q = 0.5 * np.cos(np.pi * t / 3.0)[:, None] * np.ones(7)
    names = wam.arm.robot.joint_names
    data = dataset(recording(names, t, q, np.ones_like(q)), names, "log")
    process = processing(replace(wam.arm, harmonic_hz=None), data)
    assert process.least_s < 3.0
    assert process.reason == "the lowest whose filter fits into the recording"
