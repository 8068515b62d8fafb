"""Stamps that jitter: joints tell which clock their samples were taken by."""

import numpy as np
import pytest

from ident.checks.recorder_faults.lost_samples import repeated_and_skipped
from ident.checks.settings import DEFAULT
from ident.recordings.dataset import dataset
from wamctl.arm.recording import Recording

NAMES = ("shoulder", "elbow")
START_NS = 1_700_000_000_000_000_000
HZ, SECONDS = 500, 20.0


def moved(t):
    """Positions of two joints [rad], shape (S, 2)."""
    return np.column_stack([np.sin(1.9 * t) + 0.3 * np.sin(5 * t), 0.8 * np.cos(2.6 * t)])


def recording(stamps_s, taken_s, step=1e-6):
    """A log whose samples were taken at some instants and stamped with others."""
    q = np.round(moved(taken_s) / step) * step
    stamp_ns = START_NS + np.round(stamps_s * 1e9).astype(np.int64)
    return Recording(NAMES, stamp_ns, q, None, np.cos(taken_s)[:, None] * (1.0, 2.0))


def instants(jitter_s, seed=0):
    """Even instants, and the same with jitter of at most 0.3 periods."""
    even = np.arange(int(SECONDS * HZ)) / HZ
    off = jitter_s * np.random.default_rng(seed).normal(size=len(even))
    return even, even + np.clip(off, -0.3 / HZ, 0.3 / HZ)


@pytest.mark.parametrize("jitter_s", [5e-5, 2e-4, 6e-4])
def test_samples_that_were_taken_evenly_are_even(jitter_s):
    even, stamps = instants(jitter_s)
    data = dataset(recording(stamps, even), NAMES, "log")
    (part,) = data.segments
    assert data.rate_hz == pytest.approx(HZ, rel=1e-5)
    assert part.q == pytest.approx(moved(even)[: len(part.q)], abs=2e-5)
    assert data.source.jitter_s == pytest.approx(np.std(stamps - even), rel=0.05)
    assert any("stamps jitter" in fact for fact in data.facts)
    assert repeated_and_skipped(data.segments, data, DEFAULT) == (0, 0)


def test_stamps_that_are_right_stay():
    even, stamps = instants(6e-4)
    data = dataset(recording(stamps, stamps), NAMES, "log")
    (part,) = data.segments
    assert data.source.jitter_s == 0.0
    assert part.q == pytest.approx(moved(stamps[0] + even)[: len(part.q)], abs=2e-5)


def test_what_an_encoder_does_not_tell_leaves_the_stamps():
    even, stamps = instants(5e-5)
    assert dataset(recording(stamps, even, step=2e-3), NAMES, "log").source.jitter_s == 0.0


def test_a_clock_that_wanders_is_no_even_one():
    even, stamps = instants(2e-4)
    wandering = stamps + 0.004 * np.sin(0.4 * even)
    assert dataset(recording(wandering, even), NAMES, "log").source.jitter_s == 0.0


def test_lost_samples_leave_the_stamps():
    even, stamps = instants(2e-4)
    kept = np.delete(np.arange(len(even)), [3000, 3001, 7000])
    data = dataset(recording(stamps[kept], even[kept]), NAMES, "log")
    assert data.source.lost == 3
    assert data.source.jitter_s == 0.0
