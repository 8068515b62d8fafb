"""Ring, writer process and logger."""

import os
import signal

import numpy as np
import pytest

from wamctl.arm.control import Setpoint
from wamctl.arm.errors import DataError
from wamctl.arm.recording import read_recording
from wamctl.errors import SafetyStopError
from wamctl.telemetry import ring as shared
from wamctl.telemetry.logger import LogHead, recorded
from wamctl.telemetry.status import LoopStatus, diagnostics, store

STATUS = LoopStatus(3, 100, 1, 2, 3, 4, 55.4, 234.6, 7)


def head(path):
    return LogHead(path, ("a", "b"), ("drive 1", "drive 2"), {8: "FAULT"}, {"x": "y"}, {"f": b"z"})


def fill(log, cycles, start=0):
    for k in range(start, start + cycles):
        row = np.array([k, -k], dtype=float)
        log.cycle(k * 2_000_000, row, row + 1, Setpoint(row + 2, row + 3, row + 4), row + 5)


def test_every_row_reaches_the_log(tmp_path):
    with recorded(head(tmp_path / "log.mcap"), waits=True, shown=False) as log:
        fill(log, 5000)  # more than the ring holds
    found = read_recording(tmp_path / "log.mcap")
    ramp = np.arange(5000.0)
    assert found.q[:, 0] == pytest.approx(ramp)
    assert found.qd[:, 0] == pytest.approx(ramp + 1)
    assert found.reference.qdd[:, 0] == pytest.approx(ramp + 4)
    assert found.command.effort[:, 0] == pytest.approx(ramp + 5)
    assert found.metadata["x"] == "y"
    assert found.attachments["f"] == b"z"


def test_a_log_that_cannot_be_written_is_refused_before_anything_moves(tmp_path):
    path = tmp_path / "nowhere" / "log.mcap"
    with pytest.raises(DataError) as error, recorded(head(path), waits=False, shown=False):
        pass
    assert str(error.value) == f"The log {path} cannot be written (No such file or directory)."


def run_with_a_killed_writer(path):
    with recorded(head(path), waits=True, shown=False) as log:
        fill(log, 4500)
        os.kill(log.process_id, signal.SIGKILL)
        os.waitid(os.P_PID, log.process_id, os.WEXITED | os.WNOWAIT)
        log.status(9_000_000_000, STATUS, [8, 8])


def test_a_writer_that_is_killed_stops_the_arm_and_leaves_a_log(tmp_path):
    path = tmp_path / "log.mcap"
    with pytest.raises(SafetyStopError) as stop:
        run_with_a_killed_writer(path)
    assert stop.value.cause == f"the process that writes the log {path} ended with status -9"
    assert len(read_recording(path).q) > 0


def test_after_it_broke_a_log_drops_rows_without_a_word(tmp_path):
    path = tmp_path / "log.mcap"
    with recorded(head(path), waits=False, shown=False) as log:
        os.kill(log.process_id, signal.SIGSTOP)
        try:
            with pytest.raises(SafetyStopError) as stop:
                fill(log, shared.SLOTS + 100)
            fill(log, 10)
            log.status(0, STATUS, [8, 8])
        finally:
            os.kill(log.process_id, signal.SIGCONT)
    assert stop.value.cause == (
        f"the process that writes the log {path} is {shared.SLOTS} records behind"
    )
    assert len(read_recording(path).q) == shared.SLOTS


def test_a_status_survives_the_ring():
    row = np.zeros(40)
    store(row, STATUS, [8, 1])
    loop, first, second = diagnostics(row, ("drive 1", "drive 2"), {8: "FAULT"})
    assert (loop.name, loop.message, loop.level) == ("loop", "excite", 1)
    assert loop.values["latency_us"] == "55"
    assert loop.values["lost_frames"] == "2"
    assert (first.message, second.message) == ("FAULT", "unknown state 0x1")


def test_an_empty_ring_has_room_and_a_full_one_has_none():
    with shared.created(2) as (_, ring):
        assert ring.free_slot() == 0
        ring.header[shared.PRODUCED] = shared.SLOTS + 5
        ring.header[shared.CONSUMED] = 6
        assert ring.free_slot() == 5
        ring.header[shared.CONSUMED] = 5
        assert ring.free_slot() == -1
