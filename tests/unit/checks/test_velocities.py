"""Velocities of a log that tell of another way than its positions do."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.recorder_faults.velocities import stuck_remarks, velocity_remarks
from ident.checks.settings import DEFAULT
from ident.recordings.dataset import dataset
from wamctl.arm.recording import Recording

LOG = Experiment(joints=4).log()
RATE = np.gradient(LOG.q, LOG.t, axis=0)
STAMPS = np.round(LOG.t * 1e9).astype(np.int64)


def told(q, qd, kept=slice(None), in_degrees=(False,) * 4):
    """What is said of a recording, of some of its samples."""
    bag = Recording(LOG.names, STAMPS[kept], q[kept], qd[kept], LOG.tau[kept])
    return velocity_remarks(
        dataset(bag, LOG.names, "log"), LOG.names, np.array(in_degrees), DEFAULT
    )


def stuck(q, qd):
    """The same, of positions that stay where they are."""
    bag = Recording(LOG.names, STAMPS, q, qd, LOG.tau)
    return stuck_remarks(dataset(bag, LOG.names, "log"), LOG.names)


def test_positions_that_were_taken_for_degrees_are_compared_in_rad():
    q = LOG.q * np.where(np.arange(4) == 2, 180 / np.pi, 1.0)
    assert told(q, RATE, in_degrees=np.arange(4) == 2) == []
    assert told(q, RATE)[0].joints == (3,)


def test_an_encoder_that_stops_while_its_velocity_moves_is_told():
    q = LOG.q.copy()
    q[700:, 2] = q[700, 2]
    (remark,) = stuck(q, RATE)
    assert remark.joints == (3,)
    assert "for 5 s" in remark.sentence


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_joint_that_is_held_is_not_stuck(noise):
    q, qd = LOG.q.copy(), RATE + noise * np.random.default_rng(0).normal(size=RATE.shape)
    q[700:, 2], qd[700:, 2] = q[700, 2], qd[700:, 2] - RATE[700:, 2]
    assert stuck(q, qd) == []
    assert stuck(np.round(LOG.q / 0.002) * 0.002, qd) == []


def test_noise_of_a_resting_joint_is_no_motion():
    """Over a long rest, what a velocity's counts are off adds up to a way."""
    q, qd = LOG.q.copy(), RATE.copy()
    q[700:, 2] = q[700, 2]
    speed = np.sqrt(np.mean(RATE[:, 2] ** 2))
    for share, places in ((0.2, []), (0.5, [(3,)])):
        qd[700:, 2] = share * speed
        assert [r.joints for r in stuck(q, qd)] == places
        assert share * speed * 5.0 > 0.2 * np.ptp(q[:, 2])


def test_differences_of_positions_that_the_recorder_held_are_let_be():
    """Each reading stands there three times, so that its difference is three times too fast."""
    held = np.arange(len(LOG.t)) // 3 * 3
    q, tau = LOG.q[held], LOG.tau[held]
    qd = np.diff(q, axis=0, prepend=q[:1]) / np.median(np.diff(LOG.t))
    bag = Recording(LOG.names, STAMPS, q, qd, tau)
    read = dataset(bag, LOG.names, "log")
    assert read.source.copies == pytest.approx(3.0)
    assert velocity_remarks(read, LOG.names, np.zeros(4, dtype=bool), DEFAULT) == []


def filtered(x, share=0.3):
    """A velocity as a driver tells it: through a low-pass of the first order."""
    y = x.copy()
    for k in range(1, len(x)):
        y[k] = y[k - 1] + share * (x[k] - y[k - 1])
    return y


@pytest.mark.parametrize(
    "qd",
    [
        RATE,
        filtered(RATE),
        RATE + 0.1 + 0.3 * np.random.default_rng(1).normal(size=RATE.shape),
        np.zeros_like(RATE),
        np.full_like(RATE, np.nan),
        np.random.default_rng(2).normal(size=RATE.shape),
        RATE * 180 / np.pi,
        RATE * 30 / np.pi,
    ],
    ids=["right", "filtered", "noisy", "none", "nan", "chance", "degrees", "turns"],
)
def test_nothing_is_said_of_velocities_that_say_the_same_or_nothing(qd):
    assert told(LOG.q, qd) == []


@pytest.mark.parametrize("velocity", [RATE, filtered(RATE)], ids=["right", "filtered"])
def test_positions_in_a_scale_of_their_own_are_told(velocity):
    (remark,) = told(0.9 * LOG.q, velocity)
    assert remark.code == "positions"
    assert remark.joints == (1, 2, 3, 4)
    assert "1.11 times that of the positions at joints 1 to 4," in remark.sentence


def test_joints_with_factors_of_their_own_are_listed_beside_a_hole():
    factors = np.array([1.0, 1.25, 1.0, -1.0])
    kept = np.r_[0 : len(RATE) // 3, len(RATE) // 2 : len(RATE)]
    (remark,) = told(LOG.q, factors * RATE, kept)
    assert remark.joints == (2, 4)
    assert "1.25 times that of its positions at joint 2" in remark.sentence
    assert "-1 times that of its positions at joint 4" in remark.sentence
