"""Intervals that hold the truth as often as they say, where white-noise intervals do not."""

import numpy as np
import pytest
from pendulum import pendulum
from synthetic_arm import recording

from ident.dynamics.parameters import Terms
from ident.estimation.problem import ordinary
from ident.estimation.regression_data import reduce_recordings
from ident.identification.standard_errors import QUANTILE_90, joint_errors
from ident.model.arm import Arm
from ident.recordings.dataset import dataset
from wamctl.arm.config import IdentificationSection
from wamctl.arm.robot import cad_parameters, inverse_dynamics, load_robot

RUNS = 100


def multisine(t):
    """Position, velocity, and acceleration of two joints."""
    rng = np.random.default_rng(5)
    omega = 2 * np.pi * 0.1 * np.arange(1, 5)
    a, b = rng.normal(size=(2, 4, 2)) / np.arange(1, 5)[:, None]
    sin, cos = np.sin(np.outer(t, omega)), np.cos(np.outer(t, omega))
    q = sin @ a + cos @ b
    return q, (cos * omega) @ a - (sin * omega) @ b, -(sin * omega**2) @ a - (cos * omega**2) @ b


def correlated(rng, shape):
    """Noise that remembers nine tenths of itself from sample to sample."""
    noise = rng.normal(size=shape)
    for i in range(1, len(noise)):
        noise[i] += 0.9 * noise[i - 1]
    return noise


@pytest.fixture(scope="module")
def runs():
    """Errors of the OLS parameters, a root of their covariance, white noise's errors, by run."""
    robot = load_robot(pendulum(aside=(0.05, 0.02)))
    terms = Terms(True, True, False, False, np.eye(2), False)
    arm = Arm("two", robot, IdentificationSection(cutoff_hz=5.0), terms, None, "test")
    t = np.arange(2000) / 50.0
    q, qd, qdd = multisine(t)
    fv, fc = np.array([0.5, 0.3]), np.array([0.8, 0.4])
    tau = inverse_dynamics(robot, q, qd, qdd) + fv * qd + fc * np.sign(qd)
    delta = np.column_stack([cad_parameters(robot).reshape(2, 10), fv, fc]).ravel()
    found = []
    for run in range(RUNS):
        rng = np.random.default_rng(run)
        position = q + 2e-5 * rng.normal(size=q.shape)
        log = recording(robot.joint_names, t, position, tau + 0.2 * correlated(rng, q.shape))
        evidence = reduce_recordings([dataset(log, robot.joint_names, "log")], arm)
        R = evidence.problem().R
        white = np.sqrt(np.diag(np.linalg.inv(R[:-1, :-1].T @ R[:-1, :-1])))
        white *= abs(R[-1, -1]) / np.sqrt(evidence.counts.sum())
        error = ordinary(evidence.problem()) - evidence.base.K @ delta
        found.append((error, joint_errors(evidence), white))
    return found


def test_90_percent_intervals_hold_the_truth_in_85_to_95_percent(runs):
    inside = np.array([np.abs(e) < QUANTILE_90 * np.linalg.norm(x, axis=1) for e, x, _ in runs])
    assert inside.shape == (RUNS, 10)
    assert 0.85 < inside.mean() < 0.95
    assert (inside.mean(axis=0) > 0.8).all()


def test_white_noise_intervals_promise_too_much(runs):
    assert np.mean([np.abs(error) < 1.645 * white for error, _, white in runs]) < 0.7


def test_the_errors_of_parameters_go_together_as_their_root_says(runs):
    """Intervals of 200 sums of the parameters, which errors taken apart make far too wide."""
    rng = np.random.default_rng(3)
    sums = rng.normal(size=(200, 10))
    (inside, too_wide) = np.swapaxes(
        [
            [
                np.abs(sums @ error) < QUANTILE_90 * np.linalg.norm(sums @ x, axis=1),
                np.abs(sums @ error) < QUANTILE_90 * np.abs(sums) @ np.linalg.norm(x, axis=1),
            ]
            for error, x, _ in runs
        ],
        0,
        1,
    )
    assert 0.85 < inside.mean() < 0.95
    assert too_wide.mean() > 0.99
