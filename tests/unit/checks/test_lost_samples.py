"""Readings that are missing although the stamps are even: dropped, or only passed over."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.recorder_faults.lost_samples import repeated_and_skipped
from ident.checks.settings import DEFAULT
from ident.recordings.dataset import dataset
from wamctl.arm.recording import Recording

LOG = Experiment(joints=4).log()
PERIOD = LOG.t[1] - LOG.t[0]
SPEED = np.gradient(LOG.q, LOG.t, axis=0)
POLLED_EVERY = 1.13  # of the arm's periods


def skipped(t, q, qd, tau) -> int:
    bag = Recording(LOG.names, np.round(t * 1e9).astype(np.int64), q, qd, tau)
    data = dataset(bag, LOG.names, "log")
    return repeated_and_skipped(data.segments, data, DEFAULT)[1]


def passed_over(rng):
    """The latest reading whenever one is asked for: one in eight is never seen."""
    asked = np.arange(int((len(LOG.t) - 1) / POLLED_EVERY)) * POLLED_EVERY
    return asked * PERIOD, np.floor(asked + rng.uniform()).astype(int)


def dropped(rng):
    """Readings that are lost, while the others are stamped evenly."""
    kept = np.flatnonzero(rng.uniform(size=len(LOG.t)) > 0.04)
    return LOG.t[: len(kept)], kept


@pytest.mark.parametrize(
    ("recorded", "velocity", "lost"),
    [
        (passed_over, "measured", False),
        (passed_over, "none", True),
        (dropped, "measured", True),
        (dropped, "formed of the positions", True),
        (dropped, "none", True),
    ],
)
def test_readings_are_lost_where_positions_go_further_than_velocities_tell(
    recorded, velocity, lost
):
    t, kept = recorded(np.random.default_rng(5))
    qd = {
        "measured": SPEED[kept],
        "formed of the positions": np.gradient(LOG.q[kept], t, axis=0),
        "none": None,
    }[velocity]
    count = skipped(t, LOG.q[kept], qd, LOG.tau[kept])
    assert (count > 0.02 * len(t)) == lost
