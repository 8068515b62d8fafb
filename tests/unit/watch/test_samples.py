"""Samples of what comes from a live server: one message at a time, torque under its own topic."""

import numpy as np

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


def _together(batches):
    """All messages in the order in which they were written."""
    return sorted(
        (t, topic == TOPICS[1], topic, data)
        for batch in batches
        for topic, (stamps, payload) in batch.items()
        for t, data in zip(stamps, payload, strict=True)
    )
