"""The log under attack: hung writers, two runs on one file, files that go away, full disks."""

import os
import resource
import shutil
import signal
import time

import numpy as np
import pytest

from wamctl.arm.control import Setpoint
from wamctl.arm.errors import DataError
from wamctl.arm.recording import read_recording
from wamctl.errors import SafetyStopError
from wamctl.telemetry import logger
from wamctl.telemetry.child_process import ChildProcess
from wamctl.telemetry.logger import LogHead, recorded
from wamctl.telemetry.status import LoopStatus


def head(path):
    return LogHead(path, ("a", "b"), ("drive 1", "drive 2"), {8: "FAULT"}, {"x": "y"}, {"f": b"z"})


def run(path, action):
    """A log during which something happens."""
    with recorded(head(path), waits=True, shown=False) as log:
        action(log)


def fill(log, cycles):
    for k in range(cycles):
        row = np.array([k, -k], dtype=float)
        log.cycle(k * 2_000_000, row, row, Setpoint(row, row, row), row)


def test_a_writer_that_hangs_does_not_hold_the_end_up(tmp_path, monkeypatch):
    monkeypatch.setattr(logger, "_CLOSE_S", 0.3)
    monkeypatch.setattr(logger, "_TELL_S", 0.3)
    path, began_s = tmp_path / "log.mcap", time.monotonic()
    with pytest.raises(DataError) as error:
        run(path, lambda log: os.kill(log.process_id, signal.SIGSTOP))
    assert str(error.value) == f"The log {path} is cut: its writer was killed, since it hung."
    assert time.monotonic() - began_s < 30


def test_a_child_that_does_not_read_is_given_up():
    child = ChildProcess("this", [], [])  # prints the Zen, and ends; reads nothing
    assert child.answer(10.0).startswith("The Zen")
    assert child.end(10.0) == 0
    assert not child_process_takes_a_megabyte()


def child_process_takes_a_megabyte():
    child = ChildProcess("http.server", ["0"], [])
    took = child.tell("x" * (1 << 20), 0.2)
    assert child.end(0.2) is None
    return took


def test_two_runs_do_not_share_a_log(tmp_path):
    path = tmp_path / "log.mcap"
    with recorded(head(path), waits=True, shown=False) as log:
        fill(log, 100)
        with (
            pytest.raises(DataError) as error,
            recorded(head(path), waits=True, shown=False),
        ):
            pass
    assert str(error.value) == f"The log {path} exists already: name another with --out."
    assert len(read_recording(path).q) == 100


def test_a_folder_that_is_deleted_meanwhile_is_no_success(tmp_path):
    folder = tmp_path / "logs"
    folder.mkdir()
    path = folder / "log.mcap"
    with pytest.raises(DataError) as error:
        run(path, lambda log: shutil.rmtree(folder))
    assert str(error.value) == f"The log {path} is gone: deleted while it was written."


def test_a_file_that_is_replaced_meanwhile_is_no_success(tmp_path):
    path = tmp_path / "log.mcap"

    def replace(log):
        path.rename(tmp_path / "other.mcap")
        path.write_text("something else")

    with pytest.raises(DataError) as error:
        run(path, replace)
    assert str(error.value) == (
        f"The log {path} is another file: it was replaced while it was written."
    )


def test_the_summary_counts_what_is_on_disk(tmp_path):
    path = tmp_path / "log.mcap"
    with recorded(head(path), waits=True, shown=False) as log:
        fill(log, 700)
    assert log.summary == f"the log {path} holds 700 cycles"
    assert len(read_recording(path).q) == 700


def stopped_with_a_killed_writer(path, logs):
    with recorded(head(path), waits=True, shown=False) as log:
        logs.append(log)
        fill(log, 700)
        while log.rows_on_disk < 700:
            time.sleep(0.01)
        os.kill(log.process_id, signal.SIGKILL)
        raise SafetyStopError("the operator pressed a key")


def test_the_summary_of_a_cut_log_promises_no_more_than_there_is(tmp_path):
    path, logs = tmp_path / "log.mcap", []
    with pytest.raises(SafetyStopError):
        stopped_with_a_killed_writer(path, logs)
    assert logs[0].summary == (
        f"the log {path} is cut: its writer ended with status -9; at most 700 of 700 cycles are in "
        "it"
    )
    assert len(read_recording(path).q) <= 700


def test_the_reason_of_the_disk_is_told(tmp_path):
    path = tmp_path / "log.mcap"

    def overfill(log):
        resource.prlimit(log.process_id, resource.RLIMIT_FSIZE, (150_000, 150_000))
        for _ in range(100):
            fill(log, 500)
            time.sleep(0.02)
            log.status(0, LoopStatus(3, 0, 0, 0, 0, 0, 0, 0, 0), [8, 8])

    with pytest.raises(SafetyStopError) as stop:
        run(path, overfill)
    assert stop.value.cause == (
        f"the process that writes the log {path} cannot write any more (The log {path} cannot be "
        "written (File too large))"
    )


def test_no_file_of_the_current_folder_is_imported(tmp_path, monkeypatch):
    (tmp_path / "base64.py").write_text("raise SystemExit(77)")
    (tmp_path / "json.py").write_text("raise SystemExit(78)")
    monkeypatch.chdir(tmp_path)
    with recorded(head(tmp_path / "log.mcap"), waits=True, shown=False) as log:
        fill(log, 10)
    assert len(read_recording(tmp_path / "log.mcap").q) == 10
