"""Which stretches of recordings hypotheses are tried on."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.regression import probe
from ident.regression.probe import chunks_of

LOG = Experiment(joints=2, seconds=20.0).log()
ARM = LOG.arm()


def with_a_hole(from_s: float):
    keep = (LOG.t < from_s) | (LOG.t > from_s + 0.5)
    return LOG.with_(t=LOG.t[keep], q=LOG.q[keep], tau=LOG.tau[keep]).dataset(ARM)


@pytest.mark.parametrize("from_s", [0.5, 10.0, 19.0])
def test_what_comes_after_a_hole_counts_in_each_of_many_recordings(from_s):
    data = [with_a_hole(from_s)] * 6
    seconds = sum(len(c.q) / c.rate_hz for c in chunks_of(data))
    assert seconds > 0.9 * 6 * 19.5


def test_of_long_recordings_evenly_spread_stretches_count(monkeypatch):
    monkeypatch.setattr(probe, "_CHUNK", 50)
    monkeypatch.setattr(probe, "_MOST_SAMPLES", 400)
    found = chunks_of([LOG.dataset(ARM)] * 2)
    for log in (0, 1):
        starts = [c.start_s for c in found if c.log == log]
        assert len(starts) == 4
        np.testing.assert_allclose(np.diff(starts), 20.0 / 4, atol=0.6)
