"""Wanted positions carry no joint names: another order than the joints' is told."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.samples import reference_remarks
from ident.checks.settings import DEFAULT
from ident.recordings.dataset import dataset
from wamctl.arm.recording import Recording
from wamctl.arm.ros2.joint_series import ReferenceSeries


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [1, 0, 2, 3], [3, 0, 1, 2], [0, 3, 2, 1]])
@pytest.mark.parametrize("error", [0.0, 0.02])
def test_the_order_of_the_reference(order, error):
    log = Experiment(joints=4).log()
    stamps = np.round(log.t * 1e9).astype(np.int64)
    wanted = (log.q + error * np.sin(3 * log.t)[:, None])[:, order]
    series = ReferenceSeries(stamps, wanted, wanted, wanted)
    bag = Recording(log.names, stamps, log.q, None, log.tau, reference=series)
    found = reference_remarks(dataset(bag, log.names, "log"), log.names, DEFAULT)
    if order == [0, 1, 2, 3]:
        assert found == []
        return
    assert [r.code for r in found] == ["joint_order"]
    place = next(k for k in range(4) if order[k] != k)
    column = order.index(place)
    assert f"joint_{place + 1} is in the place of joint_{column + 1}" in found[0].sentence
