"""A log that comes in pieces gives the samples and rows of the same log read whole."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_arm import recording

from ident.estimation.regression_data import reduce_recordings
from ident.recordings.dataset import dataset, dataset_of
from ident.recordings.log_summary import summarise_log
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Command, Piece, ReferenceSeries
from wamctl.arm.ros2.joint_series import JointSeries

NAMES = ("a", "b")


@dataclass(frozen=True)
class InPieces:
    """A recording whose topics come in pieces, each topic cut at places of its own."""

    recording: object
    cuts: tuple

    def pieces(self):
        log, (states, commands, wanted) = self.recording, self.cuts
        for i in range(len(states) - 1):
            s, c, r = (slice(cut[i], cut[i + 1]) for cut in (states, commands, wanted))
            yield Piece(
                JointSeries(log.joint_names, log.stamp_ns[s], log.q[s], None, log.effort[s])
                if s.stop > s.start
                else None,
                series(log.command, log.joint_names, c) if log.command else None,
                wanted_series(log.reference, r) if log.reference else None,
            )


def series(command, names, part):
    return JointSeries(names, command.stamp_ns[part], None, None, command.effort[part])


def wanted_series(reference, part):
    columns = (reference.stamp_ns, reference.q, reference.qd, reference.qdd)
    return ReferenceSeries(*(c[part] for c in columns))


def uneven(rng, irregular):
    """Ten seconds with two holes, a repeated stamp, and commands at another rate."""
    t = np.arange(1000) / 100
    t = t[(t < 3) | ((t > 3.5) & (t < 7)) | (t > 7.4)]
    if irregular:
        t = t + rng.uniform(-0.003, 0.003, len(t))
    t[40] = t[39]
    q = np.column_stack([np.sin(t), np.cos(2 * t)])
    at = np.arange(-5, 1400) / 137
    held = rng.normal(size=(len(at), 2))
    ns = np.round((at + 1) * 1e9).astype(np.int64)
    wanted = ReferenceSeries(ns, held, held, held)
    return recording(
        NAMES, t + 1, q, 0.1 * q, command=Command(ns, None, None, held), reference=wanted
    )


@given(seed=st.integers(0, 1000), count=st.integers(1, 60), irregular=st.booleans())
@settings(max_examples=60, deadline=None)
@pytest.mark.parametrize("torque", ["commanded", "measured"])
def test_samples_do_not_depend_on_the_pieces(torque, seed, count, irregular):
    rng = np.random.default_rng(seed)
    whole = uneven(rng, irregular)
    lengths = (len(whole.q), len(whole.command.effort), len(whole.reference.q))
    cuts = tuple(np.sort([0, *rng.integers(0, n + 1, count - 1), n]) for n in lengths)
    wanted = dataset(whole, NAMES, "log", torque)
    found = dataset_of(summarise_log(InPieces(whole, cuts), "log"), NAMES, torque)
    for what in ("rate_hz", "spans", "torque", "has_reference", "facts"):
        assert getattr(found, what) == getattr(wanted, what)
    assert len(found.segments) == len(wanted.segments) == 3
    for a, b in zip(found.segments, wanted.segments, strict=True):
        assert a.start_s == b.start_s
        for what in ("q", "tau", "reference"):
            np.testing.assert_allclose(getattr(a, what), getattr(b, what), atol=1e-9)


def test_rows_do_not_depend_on_the_pieces(wam, noisy):
    cut = np.append(np.arange(0, len(noisy.q), 37), len(noisy.q))
    found = summarise_log(InPieces(noisy, (cut, cut, cut)), "log")
    whole = reduce_recordings([dataset(noisy, noisy.joint_names, "log")], wam.arm)
    pieces = reduce_recordings([dataset_of(found, noisy.joint_names)], wam.arm)
    np.testing.assert_array_equal(pieces.counts, whole.counts)
    np.testing.assert_allclose(np.abs(pieces.triangles), np.abs(whole.triangles), atol=1e-9)


def test_no_part_of_a_long_log_is_held_for_long(noisy):
    cut = np.append(np.arange(0, len(noisy.q), 100), len(noisy.q))
    data = dataset_of(summarise_log(InPieces(noisy, (cut, cut, cut)), "log"), noisy.joint_names)
    lengths = [len(part.q) for _, part in data.read()]
    assert sum(lengths) == len(noisy.q)
    assert max(lengths) <= 103


def test_stamps_that_run_backwards_are_found_between_pieces(noisy):
    stamps = noisy.stamp_ns.copy()
    stamps[200:] -= 40_000_000
    cut = np.array([0, 200, len(stamps)])
    with pytest.raises(DataError, match=r"^log: the stamp of sample 200 lies 0\.036 s before"):
        summarise_log(InPieces(replace(noisy, stamp_ns=stamps), (cut, cut, cut)), "log")


def test_a_log_of_holes_is_refused(noisy):
    stamps = np.arange(4000).repeat(2) * 1_000_000_000 + np.tile([0, 1_000_000], 4000)
    log = replace(noisy, stamp_ns=stamps, q=np.resize(noisy.q, (8000, 7)))
    log = replace(log, effort=log.q)
    with pytest.raises(DataError) as caught:
        summarise_log(log, "log")
    assert str(caught.value) == "log has 1000 holes or more; repair the recording."
