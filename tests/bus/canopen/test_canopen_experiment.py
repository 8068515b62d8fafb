"""The whole experiment on simulated Puck 4 drives, in both wirings."""

import numpy as np
import pytest

from tests.bus.buses import on_embedded_bus
from wamctl.arm.recording import read_recording
from wamctl.errors import UsageError
from wamctl.experiment.excite import ExciteRequest, excite
from wamctl.experiment.preflight import prepare

ENABLE, ZERO = 0x0F, b"\0" * 8


@pytest.fixture(scope="module")
def runs(serve_arms):
    """Two runs with one seed: each the arm and the outcome."""
    done = []
    for _ in range(2):
        with serve_arms(seed=3) as arm:
            done.append((arm, arm.excite()))
    return done


def is_complete(done):
    assert done.error is None
    assert done.summary.counted == 500
    assert vars(done.summary.frames) == {
        "lost": 0,
        "late": 0,
        "doubled": 0,
        "reordered": 0,
        "malformed": 0,
        "foreign": 0,
        "lost_by_drive": {f"drive {k} (node {k})": 0 for k in range(1, 8)},
    }
    recording = done.recording
    assert len(recording.stamp_ns) == done.summary.rows == done.summary.timing.cycles
    assert set(np.diff(recording.stamp_ns)) == {2_000_000}
    assert np.abs(recording.reference.q - recording.q).max() < 0.1
    assert np.ptp(recording.q[:, :6], axis=0).min() > 0.05


def test_the_log_holds_every_cycle(runs):
    is_complete(runs[0][1])


@on_embedded_bus("word")
def test_one_torque_frame_per_drive_does_as_well(serve_arms):
    with serve_arms(drives={"wiring": "pdo_per_drive"}) as arm:
        is_complete(arm.excite())


def test_the_log_needs_no_other_file(runs):
    recording = runs[0][1].recording
    assert recording.metadata["arm"] == "wam7"
    assert set(recording.attachments) == {"config.yaml", "robot.urdf", "trajectory.yaml"}


def test_the_log_of_a_seed_is_the_same_every_time(runs):
    first, second = (done.recording for _, done in runs)
    for column in ("stamp_ns", "q", "qd"):
        assert getattr(first, column).tobytes() == getattr(second, column).tobytes()
    assert first.command.effort.tobytes() == second.command.effort.tobytes()


def test_torque_is_logged_at_the_instant_from_which_it_acts(runs):
    arm, done = runs[0]
    file = prepare(arm.path).arm.file
    acting = dict(arm.witness.torques)  # the last torques under which physics ran up to a time
    logged = done.recording.command.effort
    since_start = done.recording.stamp_ns - done.recording.stamp_ns[0]
    ends_ns = (since_start + arm.witness.sync_ns[0] + 2_000_000)[:-2]  # until they are switched off
    permille = np.array([acting[end] for end in ends_ns])
    truth = permille * file.drives.rated_torque_nm / 1000 @ file.transmission.motor_from_joint
    assert np.abs(logged[:-2] - truth).max() < 1e-9


def test_no_drive_is_enabled_before_its_torque_was_set_to_zero(runs):
    arm, _ = runs[0]
    heard = [(f.can_id, f.data) for _, f in arm.witness.heard]
    first_sync = heard.index((0x080, b""))
    assert (0x200, ZERO) in heard[:first_sync]
    assert (0x300, ZERO) in heard[:first_sync]
    enabling = next(i for i, (can_id, data) in enumerate(heard) if is_enabling(can_id, data))
    assert enabling > first_sync
    torques = {data for can_id, data in heard[:enabling] if can_id in (0x200, 0x300)}
    assert torques == {ZERO}


def is_enabling(can_id, data):
    return 0x301 <= can_id <= 0x307 and data[0] == ENABLE


def test_a_cut_log_opens_up_to_its_last_chunk(runs):
    arm, done = runs[1]
    log = arm.path.with_name("log.mcap")
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    cut = read_recording(log)
    assert 0 < len(cut.q) < len(done.recording.q)
    assert np.array_equal(cut.q, done.recording.q[: len(cut.q)])


def test_a_log_is_never_overwritten(serve_arms):
    with serve_arms() as arm:
        log = arm.path.with_name("log.mcap")
        log.write_bytes(b"precious")
        prepared = prepare(arm.path)
        with pytest.raises(UsageError) as refused:
            excite(ExciteRequest(prepared, arm.setup, log, lambda connection: None))
    assert str(refused.value) == f"The log {log} exists already: name another with --out."
    assert log.read_bytes() == b"precious"
