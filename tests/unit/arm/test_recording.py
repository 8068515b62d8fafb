"""Bags of other people: any writer, any order, any joints, and one sentence for each fault."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag
from rosbags.typesys import Stores, get_typestore

from wamctl.arm.errors import DataError
from wamctl.arm.recording import LogFile, read_recording
from wamctl.arm.ros2.joint_groups import joint_groups

STORE = get_typestore(Stores.LATEST)
STATES = "/joint_states"
JOINTS = ["a", "b", "c"]
Message = tuple[str, int, list[str], Any, Any, Any]


def joint_state(names: list[str], stamp_ns: int, q: Any, qd: Any, effort: Any) -> bytes:
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 1_000_000_000))
    header = types["std_msgs/msg/Header"](stamp, "")
    arrays = [np.array(x, dtype=float) for x in (q, qd, effort)]
    message = types["sensor_msgs/msg/JointState"](header, names, *arrays)
    return bytes(STORE.serialize_cdr(message, "sensor_msgs/msg/JointState"))


def bag(path: Path, messages: Sequence[Message], **options: Any) -> Path:
    """A bag as another program writes it; its log times lie 5 ms behind the stamps."""
    kind = options.pop("kind", "sensor_msgs/msg/JointState")
    encoding = options.pop("encoding", "cdr")
    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start("ros2")
        schema = writer.register_schema(kind, "ros2msg", b"")
        channels: dict[str, int] = {}
        for topic, stamp, *content in messages:
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, encoding, schema)
            data = joint_state(content[0], stamp, *content[1:])
            writer.add_message(channels[topic], stamp + 5_000_000, data, stamp)
        writer.finish()
    return path


def motion(samples: int = 20, topic: str = STATES, names: list[str] = JOINTS) -> list[Message]:
    rng = np.random.default_rng(0)
    stamps = np.cumsum(rng.integers(1_000_000, 9_000_000, samples)).tolist()
    rows = rng.normal(size=(samples, 3, len(names)))
    return [(topic, t, names, *row) for t, row in zip(stamps, rows, strict=True)]


def refused(path: Path, **options: Any) -> str:
    with pytest.raises(DataError) as caught:
        read_recording(path, **options)
    assert caught.value.exit_code == 6
    return str(caught.value)


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.LZ4, "chunk_size": 300},
        {"compression": CompressionType.ZSTD, "chunk_size": 300, "enable_crcs": False},
    ],
)
def test_every_form_of_mcap_is_read_with_its_irregular_stamps(
    tmp_path: Path, options: dict[str, Any]
) -> None:
    messages = motion()
    recording = read_recording(bag(tmp_path / "bag.mcap", messages, **options))
    assert recording.joint_names == tuple(JOINTS)
    assert recording.complete
    np.testing.assert_array_equal(recording.stamp_ns, [m[1] for m in messages])
    for column, place in ((recording.q, 3), (recording.qd, 4), (recording.effort, 5)):
        np.testing.assert_array_equal(column, [m[place] for m in messages])
    assert recording.command is None
    assert recording.reference is None


def test_an_unchunked_bag_cut_anywhere_keeps_its_whole_messages(tmp_path: Path) -> None:
    messages = motion()
    path = bag(tmp_path / "bag.mcap", messages, use_chunking=False)
    data = path.read_bytes()
    start = data.find(joint_state(JOINTS, *messages[0][1:2], *messages[0][3:]))
    for length in range(start + 400, len(data), 97):
        path.write_bytes(data[:length])
        recording = read_recording(path)
        samples = len(recording.q)
        np.testing.assert_array_equal(recording.q, [m[3] for m in messages[:samples]])
        assert samples == len(messages) or not recording.complete


def test_joints_are_matched_by_name_in_any_order(tmp_path: Path) -> None:
    messages = motion()
    turned = [
        (topic, t, *(column[:: -1 if k % 3 else 1] for column in columns))
        for k, (topic, t, *columns) in enumerate(messages)
    ]
    recording = read_recording(bag(tmp_path / "bag.mcap", turned))
    np.testing.assert_array_equal(recording.q, [m[3] for m in messages])
    chosen = read_recording(tmp_path / "bag.mcap", joints=("c", "a"))
    assert chosen.joint_names == ("c", "a")
    np.testing.assert_array_equal(chosen.effort, [m[5][[2, 0]] for m in messages])


def test_a_gripper_on_the_same_topic_is_left_out(tmp_path: Path) -> None:
    arm, gripper = motion(), motion(7, names=["finger"])
    both = sorted([*arm, *gripper], key=lambda m: m[1])
    path = bag(tmp_path / "bag.mcap", both)
    recording = read_recording(path, joints=("a", "b", "c"))
    np.testing.assert_array_equal(recording.q, [m[3] for m in arm])
    assert refused(path).startswith(f"{path}: /joint_states changes its joints at ")
    assert refused(path).endswith(": name the arm's joints with --robot.")
    assert joint_groups(path, STATES) == [("a", "b", "c"), ("finger",)]
    assert joint_groups(path, "/elsewhere") == []


def test_one_driver_is_one_group_whatever_the_order_of_its_joints(tmp_path: Path) -> None:
    turned = motion(5, names=["c", "a", "b"])
    path = bag(tmp_path / "bag.mcap", [*motion(), *turned])
    assert joint_groups(path, STATES) == [("a", "b", "c")]


def test_another_kind_of_message_has_no_joints(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag.mcap", motion(), kind="sensor_msgs/msg/Imu")
    assert joint_groups(path, STATES) == []


def test_commands_are_read_beside_the_states(tmp_path: Path) -> None:
    commands = motion(9, "/joint_commands", ["c", "b", "a"])
    states = [(topic, t, names, q, qd, []) for topic, t, names, q, qd, _ in motion()]
    recording = read_recording(bag(tmp_path / "bag.mcap", [*states, *commands]))
    assert recording.effort is None
    assert recording.command is not None
    np.testing.assert_array_equal(recording.command.effort, [m[5][::-1] for m in commands])
    np.testing.assert_array_equal(recording.command.stamp_ns, [m[1] for m in commands])


def test_other_topics_can_be_named(tmp_path: Path) -> None:
    messages = [*motion(topic="/left/state"), *motion(topic="/left/command")]
    path = bag(tmp_path / "bag.mcap", messages)
    recording = read_recording(path, "/left/state", "/left/command")
    assert recording.command is not None
    np.testing.assert_array_equal(recording.command.effort, recording.effort)
    kind = "sensor_msgs/msg/JointState"
    topics = f"/left/state ({kind}), /left/command ({kind})"
    assert refused(path) == (
        f"{path} has no topic /joint_states; its topics are {topics}."
        " Choose one with --joint-states TOPIC."
    )
    assert refused(path, joint_states="/left/state", joint_commands="/no") == (
        f"{path} has no topic /no; its topics are {topics}. Choose one with --joint-commands TOPIC."
    )


def test_headers_without_a_stamp_take_the_log_time(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        channel = writer.register_channel(STATES, "cdr", schema)
        for stamp in (3, 5, 9):
            writer.add_message(channel, stamp, joint_state(["a"], 0, [1], [], [2]), stamp)
        writer.finish()
    assert read_recording(path).stamp_ns.tolist() == [3, 5, 9]


def test_a_folder_of_split_files_is_one_recording(tmp_path: Path) -> None:
    messages = motion()
    bag(tmp_path / "bag_0.mcap", messages[:8])
    bag(tmp_path / "bag_1.mcap", messages[8:])
    metadata = tmp_path / "metadata.yaml"
    metadata.write_text(
        "rosbag2_bagfile_information:\n  relative_file_paths: [bag_0.mcap, bag_1.mcap]\n"
    )
    np.testing.assert_array_equal(read_recording(tmp_path).q, [m[3] for m in messages])
    metadata.write_text("rosbag2_bagfile_information: {relative_file_paths: [bag_2.mcap]}\n")
    assert refused(tmp_path) == f"{metadata} names missing files: {tmp_path / 'bag_2.mcap'}."
    metadata.write_text("version: 5\n")
    assert refused(tmp_path) == (f"{metadata} does not name the bag's files (relative_file_paths).")
    metadata.unlink()
    assert refused(tmp_path) == (
        f"{tmp_path} is a folder without metadata.yaml:"
        " give the folder of a ROS 2 bag, or an .mcap file."
    )


@pytest.mark.parametrize("storage", StoragePlugin)
def test_a_bag_of_rosbags(tmp_path: Path, storage: StoragePlugin) -> None:
    messages = [*motion(), *motion(7, "/joint_commands"), *motion(9, "/other")]
    with Bag(tmp_path / "bag", version=9, storage_plugin=storage) as writer:
        kind = "sensor_msgs/msg/JointState"
        topics = {m[0] for m in messages}
        connections = {t: writer.add_connection(t, kind, typestore=STORE) for t in topics}
        for topic, stamp, *content in sorted(messages, key=lambda m: m[1]):
            writer.write(connections[topic], stamp, joint_state(content[0], stamp, *content[1:]))
    recording = read_recording(tmp_path / "bag")
    np.testing.assert_array_equal(recording.q, [m[3] for m in messages[:20]])
    np.testing.assert_array_equal(recording.stamp_ns, [m[1] for m in messages[:20]])
    assert recording.command is not None
    np.testing.assert_array_equal(recording.command.effort, [m[5] for m in messages[20:27]])
    (file,) = (p for p in (tmp_path / "bag").iterdir() if p.suffix != ".yaml")
    np.testing.assert_array_equal(read_recording(file).q, recording.q)
    if storage is StoragePlugin.SQLITE3:
        assert refused(file, joint_states="/no").startswith(f"{file} has no topic /no; its topics")
        file.write_bytes(file.read_bytes()[:5000])
        assert refused(file).startswith(f"{file} is damaged, or not a ROS 2 bag (")


def test_a_file_that_is_compressed_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap.zstd"
    path.write_bytes(zstandard.compress(b"anything"))
    assert refused(path) == (
        f"{path} is compressed as a whole: unpack it with `zstd -d`, and give the result."
    )


@pytest.mark.parametrize("use_chunking", [True, False])
def test_long_logs_come_in_pieces(tmp_path: Path, use_chunking: bool) -> None:
    messages = motion(9000)
    options = {"chunk_size": 100_000, "use_chunking": use_chunking}
    path = bag(tmp_path / "bag.mcap", messages, **options)
    pieces = list(LogFile(path, joints=("b", "a")).pieces())
    states = [p.states for p in pieces if p.states]
    assert max(len(s.stamp_ns) for s in states) < 6500
    q = np.concatenate([s.positions for s in states])
    np.testing.assert_array_equal(q, [m[3][[1, 0]] for m in messages])


def test_commands_that_come_before_any_state_are_kept(tmp_path: Path) -> None:
    commands = motion(6000, "/joint_commands", ["c", "b", "a"])
    path = bag(tmp_path / "bag.mcap", [*commands, *motion(9)])
    recording = read_recording(path)
    assert recording.command is not None
    np.testing.assert_array_equal(recording.command.effort, [m[5][::-1] for m in commands])


def test_a_missing_file(tmp_path: Path) -> None:
    assert refused(tmp_path / "no.mcap") == (
        f"{tmp_path / 'no.mcap'} does not exist: give an .mcap or .db3 file, or a bag's folder."
    )


def test_an_empty_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    path.touch()
    assert refused(path) == f"{path} is empty (0 bytes)."


def test_a_file_of_another_kind(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t,q1,q2\n0,0,0\n")
    assert refused(path) == (
        f"{path} is no bag of ROS: give an .mcap, .db3 or .bag file,"
        " or make a log of a table with `ident import`."
    )


def test_a_bag_without_torque(tmp_path: Path) -> None:
    kind = "sensor_msgs/msg/JointState"
    for nothing in ([], [np.nan] * 3):
        messages = [(topic, t, n, q, qd, nothing) for topic, t, n, q, qd, _ in motion()]
        path = bag(tmp_path / "bag.mcap", messages)
        assert refused(path) == (
            f"{path} holds no joint torque: /joint_states has no effort, and /joint_commands has"
            f" none either; its topics are /joint_states ({kind}). Without torque, commanded"
            " positions are needed: record what the arm was asked for as well."
        )


def test_a_torque_that_ends_early(tmp_path: Path) -> None:
    messages = motion()
    messages = [
        (topic, t, n, q, qd, effort if k < 12 else [])
        for k, (topic, t, n, q, qd, effort) in enumerate(messages)
    ]
    path = bag(tmp_path / "bag.mcap", messages)
    assert refused(path) == (
        f"{path}: /joint_states carries positions, velocities, efforts at first, and positions,"
        f" velocities from {messages[12][1]} ns on: cut the recording there."
    )


def test_a_number_that_is_none(tmp_path: Path) -> None:
    messages = motion()
    messages[7][3][1] = messages[9][3][1] = np.nan
    path = bag(tmp_path / "bag.mcap", messages)
    assert refused(path) == (
        f"{path}: /joint_states: positions of b are not finite at {messages[7][1]} ns."
    )


@pytest.mark.parametrize(
    ("column", "value", "sentence"),
    [
        (3, 1e6, "position of b is 1e+06 at {} ns, beyond 100000 rad or m"),
        (5, -1e154, "effort of b is -1e+154 at {} ns, beyond 1e+09 N m or N"),
    ],
)
def test_a_number_beyond_all_measure(tmp_path: Path, column, value, sentence) -> None:
    messages = motion()
    messages[7][column][1] = value
    path = bag(tmp_path / "bag.mcap", messages)
    assert refused(path).startswith(f"{path}: /joint_states: {sentence.format(messages[7][1])}")


def test_joints_that_are_not_there(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag.mcap", motion())
    assert refused(path, joints=("a", "x", "y")) == (
        f"{path}: /joint_states has no joint 'x', 'y'; its joints are a, b, c."
    )


def test_positions_that_are_missing(tmp_path: Path) -> None:
    messages = [(topic, t, n, [], qd, effort) for topic, t, n, _, qd, effort in motion()]
    path = bag(tmp_path / "bag.mcap", messages)
    assert refused(path) == f"{path}: /joint_states carries no positions."


def test_arrays_that_do_not_fit_their_names(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag.mcap", [(STATES, 1_000, JOINTS, [0, 0, 0], [], [1, 2])])
    assert refused(path) == "The JointState at 1000 ns has 3 names and 2 efforts."


def test_another_type_on_the_topic(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag.mcap", motion(), kind="std_msgs/msg/String")
    assert refused(path) == (
        f"{path}: /joint_states is a std_msgs/msg/String, not a sensor_msgs/msg/JointState; write"
        " its values as a table, and import that (`ident import`)."
    )
    path = bag(tmp_path / "ros1.mcap", motion(), encoding="ros1")
    assert refused(path) == f"{path}: /joint_states is written in ros1, not in cdr."


def test_a_message_that_is_no_joint_state(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        writer.add_message(writer.register_channel(STATES, "cdr", schema), 1, b"\0\1\0\0abc", 1)
        writer.finish()
    assert refused(path).startswith("A message is not a sensor_msgs/msg/JointState (")


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD])
def test_a_damaged_chunk(tmp_path: Path, compression: CompressionType) -> None:
    path = bag(tmp_path / "bag.mcap", motion(), compression=compression)
    data = bytearray(path.read_bytes())
    start = data.index(b"\x06", 9 + 8 + 4)
    data[start + 400] ^= 0xFF
    path.write_bytes(data)
    assert refused(path) == (
        f"{path} is damaged: the chunk at byte {start} fails its check; copy the file again."
    )
