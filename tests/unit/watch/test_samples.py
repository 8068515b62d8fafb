"""Samples of what comes from a live server: one message at a time, torque under its own topic."""

import numpy as np
import pytest

from ident.watch.samples import Sampler
from ident.watch.sources import messages
from tests.unit.fleet.conftest import JOINTS
from wamctl.arm.recorder import Recorder

TOPICS = ("/joint_states", "/joint_commands")


def test_a_commanded_torque_that_comes_after_the_first_state_is_found(tmp_path):
    path = tmp_path / "log.mcap"
    with Recorder(path, JOINTS) as log:
        for k in range(150):
            log.joint_states(k * 20_000_000, np.full(2, 0.1 * k))
            log.add(TOPICS[1], k * 20_000_000, np.zeros(2), None, np.full(2, 3.0))
    both = _together(messages(str(path), TOPICS, 0.0))
    single = [{topic: ([t], [data])} for t, _, topic, data in both]
    found = list(Sampler(JOINTS, TOPICS, None, "live").samples(single))
    assert sum(len(s.q) for s in found) > 100
    assert all((s.tau == 3.0).all() for s in found)


@pytest.mark.parametrize("periods", [5, -5])
def test_torque_that_acts_later_than_its_stamps_is_put_to_the_motion_that_it_belongs_to(
    tmp_path, periods
):
    path = tmp_path / "log.mcap"
    with Recorder(path, JOINTS) as log:
        for k in range(300):
            log.joint_states(k * 20_000_000, np.full(2, 0.1 * k))
            log.add(TOPICS[1], k * 20_000_000, np.zeros(2), None, np.full(2, float(k)))
    torque = []
    for delay_s in (0.0, 0.02 * periods):
        sampler = Sampler(JOINTS, TOPICS, "commanded", "log", delay_s)
        found = list(sampler.samples(messages(str(path), TOPICS, 0.0)))
        torque.append(
            {round(q, 6): tau for s in found for q, tau in zip(s.q[:, 0], s.tau[:, 0], strict=True)}
        )
    plain, later = torque
    both = [q for q in sorted(plain.keys() & later.keys()) if 2.0 < q < 28.0]
    assert len(both) > 200
    np.testing.assert_allclose([plain[q] - later[q] for q in both], periods)


def _together(batches):
    """All messages in the order in which they were written."""
    return sorted(
        (t, topic == TOPICS[1], topic, data)
        for batch in batches
        for topic, (stamps, payload) in batch.items()
        for t, data in zip(stamps, payload, strict=True)
    )
