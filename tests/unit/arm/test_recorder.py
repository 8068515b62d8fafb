"""The log against readers that we did not write, at every cut, and on a full disk."""

import hashlib
import io
import resource
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from wamctl.arm.errors import DataError
from wamctl.arm.recorder import CycleRecord, Recorder, write_recording
from wamctl.arm.recording import read_recording
from wamctl.arm.ros2.log_messages import Status
from wamctl.arm.ros2.message_definition import definition

JOINTS = ("wam/base_yaw_joint", "wam/elbow_pitch_joint", "j3")
CYCLES = 700
STAMPS = 1_700_000_000_000_000_000 + 2_000_000 * np.arange(CYCLES)
ROWS = np.random.default_rng(1).normal(size=(CYCLES, 7, 3))
COLUMNS = ("q", "qd", "effort", "q_ref", "qd_ref", "qdd_ref", "tau_cmd")

# Published files: ros2/common_interfaces at c0c0bc57f958 and ros2/rcl_interfaces at f6b3741d921e.
PUBLISHED_BLOBS = {
    "builtin_interfaces/msg/Duration.msg": "e6734af438b5377615d7dac4f6ccc5eb8dfe21f6",
    "builtin_interfaces/msg/Time.msg": "dffade0e3ea98a7e51b1e30ba504184001469579",
    "diagnostic_msgs/msg/DiagnosticArray.msg": "358a0be45814bb2862f8ca02580af9f1e2bb6b60",
    "diagnostic_msgs/msg/DiagnosticStatus.msg": "b49f5c7509208bc8c40e76c9b6968bc0ae5c2489",
    "diagnostic_msgs/msg/KeyValue.msg": "2362c50474d413579bdb9d73c5cd0985963f16e3",
    "sensor_msgs/msg/JointState.msg": "ffaa9bfb0059383a6282abee168c72fdc92793ce",
    "std_msgs/msg/Header.msg": "6966bb98863c237131a2bd2822298df9511ce948",
    "trajectory_msgs/msg/JointTrajectoryPoint.msg": "01e38a4562e00a236a6bfcf5f7c347157ff6f848",
}


def write(path: Path) -> Path:
    attachments = {"config.yaml": b"arm: x\n", "robot.urdf": b"<robot/>"}
    with Recorder(path, JOINTS, {"commit": "abc"}, attachments) as recorder:
        for k, (stamp, row) in enumerate(zip(STAMPS.tolist(), ROWS, strict=True)):
            recorder.cycle(CycleRecord(stamp, *row))
            if k % 50 == 0:
                status = Status("drive 1", 1, "warm", "puck", {"temperature": "71 C"})
                recorder.diagnostics(stamp, [status, Status("bus")])
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("log") / "log.mcap")


def test_what_was_written_is_read(log: Path) -> None:
    recording = read_recording(log)
    assert recording.joint_names == JOINTS
    assert recording.metadata == {"commit": "abc"}
    assert recording.attachments == {"config.yaml": b"arm: x\n", "robot.urdf": b"<robot/>"}
    assert recording.complete
    command, reference = recording.command, recording.reference
    assert command is not None
    assert reference is not None
    found = (recording.q, recording.qd, recording.effort, reference.q, reference.qd, reference.qdd)
    for k, column in enumerate((*found, command.effort)):
        np.testing.assert_array_equal(column, ROWS[:, k], err_msg=COLUMNS[k])
    np.testing.assert_array_equal(command.q, ROWS[:, 3])
    np.testing.assert_array_equal(command.qd, ROWS[:, 4])
    for stamps in (recording.stamp_ns, command.stamp_ns, reference.stamp_ns):
        np.testing.assert_array_equal(stamps, STAMPS)


def test_equal_calls_give_equal_bytes(log: Path, tmp_path: Path) -> None:
    assert write(tmp_path / "again.mcap").read_bytes() == log.read_bytes()


def test_the_strictest_reader_accepts_it(log: Path) -> None:
    with log.open("rb") as stream:
        records = list(StreamReader(stream, validate_crcs=True, emit_chunks=True).records)
    chunks = [r for r in records if isinstance(r, Chunk)]
    assert len(chunks) == 5
    assert all(c.message_end_time - c.message_start_time < 0.4e9 for c in chunks)
    assert all(c.uncompressed_crc for c in chunks)
    with log.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        messages = [m for _, _, m in reader.iter_messages(log_time_order=False)]
        summary = reader.get_summary()
    assert [m.log_time for m in messages] == sorted(m.log_time for m in messages)
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(messages) == 3 * CYCLES + 14
    assert summary.statistics.message_start_time == STAMPS[0]
    assert summary.statistics.message_end_time == STAMPS[-1]


def test_the_bytes_are_those_of_the_library(log: Path) -> None:
    """The library's writer, given the same records and the same chunks, writes the same file."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=2**30, enable_data_crcs=True)
    writer.start("ros2", "wam-ident")
    with log.open("rb") as theirs:
        reader = make_reader(theirs)
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, metadata.metadata)
        for a in reader.iter_attachments():
            writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        summary = reader.get_summary()
        assert summary is not None
        for schema in summary.schemas.values():
            writer.register_schema(schema.name, schema.encoding, schema.data)
        for channel in summary.channels.values():
            writer.register_channel(channel.topic, channel.message_encoding, channel.schema_id)
        ends = [c.message_end_time for c in summary.chunk_indexes]
        for _, _, m in reader.iter_messages(log_time_order=False):
            if m.log_time > ends[0]:
                writer.flush()
                ends.pop(0)
            writer.add_message(m.channel_id, m.log_time, m.data, m.publish_time, m.sequence)
    writer.finish()
    assert stream.getvalue() == log.read_bytes()


def test_mcap_ros2_decodes_the_same_numbers(log: Path) -> None:
    with log.open("rb") as stream:
        reader = make_reader(stream, True, decoder_factories=[DecoderFactory()])
        decoded = [(c.topic, m) for _, c, _, m in reader.iter_decoded_messages()]
    states = [m for topic, m in decoded if topic == "/joint_states"]
    commands = [m for topic, m in decoded if topic == "/joint_commands"]
    points = [m for topic, m in decoded if topic == "/joint_reference"]
    np.testing.assert_array_equal([m.position for m in states], ROWS[:, 0])
    np.testing.assert_array_equal([m.velocity for m in states], ROWS[:, 1])
    np.testing.assert_array_equal([m.effort for m in states], ROWS[:, 2])
    np.testing.assert_array_equal([m.effort for m in commands], ROWS[:, 6])
    np.testing.assert_array_equal([m.accelerations for m in points], ROWS[:, 5])
    assert states[-1].name == list(JOINTS)
    stamp = states[-1].header.stamp
    assert stamp.sec * 10**9 + stamp.nanosec == STAMPS[-1]
    since_start = points[-1].time_from_start
    assert since_start.sec * 10**9 + since_start.nanosec == STAMPS[-1] - STAMPS[0]
    status = next(m for topic, m in decoded if topic == "/diagnostics").status
    assert [s.name for s in status] == ["drive 1", "bus"]
    assert [(v.key, v.value) for v in status[0].values] == [("temperature", "71 C")]


def test_rosbags_decodes_the_same_numbers(log: Path) -> None:
    with AnyReader([log]) as reader:
        topic = {c.topic: c for c in reader.connections}
        states = [
            reader.deserialize(raw, c.msgtype)
            for c, _, raw in reader.messages([topic["/joint_states"]])
        ]
        points = [
            reader.deserialize(raw, c.msgtype)
            for c, _, raw in reader.messages([topic["/joint_reference"]])
        ]
    np.testing.assert_array_equal([m.position for m in states], ROWS[:, 0])
    np.testing.assert_array_equal([m.effort for m in states], ROWS[:, 2])
    np.testing.assert_array_equal([m.velocities for m in points], ROWS[:, 4])


def test_a_log_cut_anywhere_keeps_its_whole_chunks(log: Path, tmp_path: Path) -> None:
    data = log.read_bytes()
    with log.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunks = summary.chunk_indexes
    ends = [c.chunk_start_offset + c.chunk_length for c in chunks]
    samples = np.searchsorted(STAMPS, [c.message_end_time for c in chunks], side="right")
    cut = tmp_path / "cut.mcap"
    cuts = np.random.default_rng(2).integers(ends[0], len(data), 60).tolist()
    for length in [*ends, *(e - 1 for e in ends[1:]), *cuts]:
        cut.write_bytes(data[:length])
        recording = read_recording(cut)
        whole = max(k for k, end in enumerate(ends) if end <= length)
        assert len(recording.q) == samples[whole], length
        assert len(recording.command.effort) == samples[whole]  # pyright: ignore
        assert recording.attachments["robot.urdf"] == b"<robot/>"
        assert not recording.complete or length > ends[-1]


def test_the_definitions_are_the_published_ones() -> None:
    folder = Path(definition.__code__.co_filename).parent / "messages"
    found = {}
    for path in sorted(folder.rglob("*.msg")):
        text = path.read_bytes()
        blob = hashlib.sha1(b"blob %d\0" % len(text) + text).hexdigest()
        found[str(path.relative_to(folder))] = blob
    assert found == PUBLISHED_BLOBS


def test_a_schema_is_written_as_rosbag2_writes_it() -> None:
    text = definition("sensor_msgs/msg/JointState")
    main, header, time = text.split("\n" + "=" * 80 + "\n")
    assert main.endswith("float64[] effort\n")
    assert header.startswith("MSG: std_msgs/Header\n# Standard metadata")
    assert time.startswith("MSG: builtin_interfaces/Time\n")


def test_a_recording_is_written_whole(log: Path, tmp_path: Path) -> None:
    recording = read_recording(log)
    copy = tmp_path / "copy.mcap"
    write_recording(copy, recording)
    again = read_recording(copy)
    for name in ("stamp_ns", "q", "qd", "effort"):
        np.testing.assert_array_equal(getattr(again, name), getattr(recording, name))
    np.testing.assert_array_equal(again.command.effort, ROWS[:, 6])  # pyright: ignore
    np.testing.assert_array_equal(again.reference.qdd, ROWS[:, 5])  # pyright: ignore
    assert again.attachments == recording.attachments
    with copy.open("rb") as stream:
        times = [m.log_time for *_, m in make_reader(stream).iter_messages(log_time_order=False)]
    assert times == sorted(times)


def test_a_full_disk_is_a_sentence() -> None:
    message = r"^The log /dev/full cannot be written \(No space left on device\)\.$"
    with pytest.raises(DataError, match=message):
        Recorder("/dev/full", JOINTS)


def test_a_disk_that_fills_up_is_a_sentence_and_closes_the_file(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    recorder = Recorder(path, JOINTS)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(DataError) as caught:
            fill(recorder)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert str(caught.value) == f"The log {path} cannot be written (File too large)."
    recorder.close()
    recording = read_recording(path)
    assert len(recording.q) > 100
    assert not recording.complete


def fill(recorder: Recorder) -> None:
    for stamp, row in zip(STAMPS.tolist(), ROWS, strict=True):
        recorder.cycle(CycleRecord(stamp, *row))


def test_a_missing_folder_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "none" / "log.mcap"
    with pytest.raises(DataError) as caught:
        Recorder(path, JOINTS)
    assert str(caught.value) == f"The log {path} cannot be written (No such file or directory)."


def test_a_log_without_samples_is_well_formed(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    Recorder(path, JOINTS).close()
    with path.open("rb") as stream:
        assert list(make_reader(stream, validate_crcs=True).iter_messages()) == []
    with pytest.raises(DataError) as caught:
        read_recording(path)
    assert str(caught.value) == f"{path}: /joint_states holds no message."


def test_a_log_of_one_topic_is_read(tmp_path: Path) -> None:
    path = tmp_path / "states.mcap"
    with Recorder(path, JOINTS) as recorder:
        recorder.joint_states(5, ROWS[0, 0], None, ROWS[0, 2])
    recording = read_recording(path)
    assert recording.stamp_ns.tolist() == [5]
    assert recording.qd is None
    assert recording.command is None
    assert recording.reference is None
