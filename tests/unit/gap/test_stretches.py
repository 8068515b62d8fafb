"""Long logs are searched by stretches, read without holding the whole log."""

import numpy as np
import pytest

from ident.gap.data.stretches import stretch_remarks, stretches
from ident.gap.settings import LongLogs
from wamctl.arm.recorder import CycleRecord, Recorder
from wamctl.arm.recording import LogFile, read_recording

RATE_HZ = 20.0


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.mcap"
    with Recorder(path, ("a", "b"), {}, {"note.txt": b"kept"}) as recorder:
        for k in range(2000):
            q = np.array([np.sin(0.01 * k), k * 1e-3])
            stamp_ns = round(k / RATE_HZ * 1e9)
            recorder.cycle(CycleRecord(stamp_ns, q, q, None, q, 2 * q, 3 * q, 4 * q))
    return LogFile(path)


def test_a_short_log_is_read_whole(log):
    ((name, found),) = stretches(log, 1, LongLogs())
    whole = read_recording(log.path)
    assert name == str(log.path)
    np.testing.assert_array_equal(found.q, whole.q)
    np.testing.assert_array_equal(found.reference.qdd, whole.reference.qdd)
    assert stretch_remarks([name], [name], LongLogs()) == ()


@pytest.mark.parametrize(("logs", "count"), [(1, 3), (2, 2), (3, 1), (5, 1)])
def test_a_long_one_by_stretches_with_all_its_topics(log, logs, count):
    bounds = LongLogs(most_s=30.0, stretch_s=10.0)
    found = stretches(log, logs, bounds)
    assert len(found) == count
    whole = read_recording(log.path)
    for name, part in found:
        assert name.startswith(f"{log.path} (")
        assert part.attachments == whole.attachments
        first = int(np.searchsorted(whole.stamp_ns, part.stamp_ns[0]))
        here = slice(first, first + round(10 * RATE_HZ))
        np.testing.assert_array_equal(part.stamp_ns, whole.stamp_ns[here])
        np.testing.assert_array_equal(part.q, whole.q[here])
        np.testing.assert_array_equal(part.command.effort, whole.command.effort[here])
        np.testing.assert_array_equal(part.reference.q, whole.reference.q[here])
    if count > 1:
        assert found[0][1].stamp_ns[0] == whole.stamp_ns[0]
        assert whole.stamp_ns[-1] - found[-1][1].stamp_ns[-1] < 2e9 / RATE_HZ
    (remark,) = stretch_remarks([name for name, _ in found], [str(log.path)], bounds)
    assert remark.code == "long_log"
    assert found[0][0] in remark.sentence
