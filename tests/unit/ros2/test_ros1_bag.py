"""Bags of ROS 1: read as they are, with one sentence for what is wrong."""

import bz2
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording, read_recording

STORE = get_typestore(Stores.ROS1_NOETIC)
JOINTS = ["a", "b", "c"]
SAMPLES = 1500
START_NS = 1_600_000_000_000_000_000
KIND = "sensor_msgs/msg/JointState"


def numbers(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(SAMPLES, 3, len(JOINTS)))


def joint_state(index: int, stamp_ns: int, row: Any) -> bytes:
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 1_000_000_000))
    header = types["std_msgs/msg/Header"](index, stamp, "base")
    message = types[KIND](header, JOINTS, *row)
    return bytes(STORE.serialize_ros1(message, KIND))


def bag(path: Path, compression: str | None = None, in_turn: bool = True) -> Path:
    """States and commands, in turn or all of one before the other, beside a topic of words.

    They are logged 3 ms after their stamps.
    """
    writer = Writer(path)
    writer.chunk_threshold = 1 << 17
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        states = writer.add_connection("/joint_states", KIND, typestore=STORE)
        commands = writer.add_connection("/joint_commands", KIND, typestore=STORE)
        words = writer.add_connection("/rosout", "std_msgs/msg/String", typestore=STORE)
        text = STORE.types["std_msgs/msg/String"]("started")
        writer.write(words, START_NS, bytes(STORE.serialize_ros1(text, "std_msgs/msg/String")))
        messages = [
            (connection, i, joint_state(i, START_NS + 2_000_000 * i, row))
            for connection, rows in ((states, numbers(0)), (commands, numbers(1)))
            for i, row in enumerate(rows)
        ]
        for connection, i, message in sorted(messages, key=lambda m: m[1] if in_turn else 0):
            writer.write(connection, START_NS + 2_000_000 * i + 3_000_000, message)
    return path


def refused(path: Path) -> str:
    with pytest.raises(DataError) as caught:
        read_recording(path)
    assert caught.value.exit_code == 6
    return str(caught.value)


@pytest.mark.parametrize("in_turn", [True, False])  # False: chunks of the same time
@pytest.mark.parametrize("compression", [None, "BZ2", "LZ4"])
def test_what_was_written_is_read(tmp_path: Path, compression: str | None, in_turn: bool) -> None:
    recording = read_recording(bag(tmp_path / "a.bag", compression, in_turn))
    assert recording.joint_names == tuple(JOINTS)
    for column, wanted in zip((recording.q, recording.qd, recording.effort), range(3), strict=True):
        assert column is not None
        np.testing.assert_array_equal(column, numbers(0)[:, wanted])
    np.testing.assert_array_equal(
        recording.stamp_ns, START_NS + 2_000_000 * np.arange(SAMPLES, dtype=np.int64)
    )
    assert recording.command is not None
    np.testing.assert_array_equal(recording.command.q, numbers(1)[:, 0])


def test_a_bag_that_was_cut_off_asks_for_an_index(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.bag")
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.999):
        path.write_bytes(whole[: int(share * len(whole))])
        assert refused(path) == (
            f"{path} has no whole index: mend it with `rosbag reindex`, and give the result."
        )
    at = whole.index(b"index_pos=") + len("index_pos=")
    path.write_bytes(whole[:at] + bytes(8) + whole[at + 8 :])  # as the recorder leaves it if killed
    assert "`rosbag reindex`" in refused(path)


def test_earlier_versions_and_other_topics_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    path.write_bytes(b"#ROSBAG V1.2\n" + bytes(100))
    assert refused(path).startswith(f"{path} is damaged, or no ROS 1 bag that can be read (")
    path.unlink()
    with Writer(path) as writer:
        connection = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=STORE)
        text = STORE.types["std_msgs/msg/String"]("hello")
        writer.write(connection, 1, bytes(STORE.serialize_ros1(text, "std_msgs/msg/String")))
    assert refused(path).startswith(f"{path} has no topic /joint_states; its topics")


def test_damaged_bytes_are_told_or_change_numbers_only(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.bag", "LZ4")
    whole = path.read_bytes()
    rng = np.random.default_rng(5)
    told = 0
    for _ in range(30):
        damaged = bytearray(whole)
        for at in rng.integers(20, len(whole), 12):
            damaged[at] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            assert isinstance(read_recording(path), Recording)
        except DataError:
            told += 1
    assert told > 15


def test_a_chunk_that_fills_the_memory_is_refused(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.bag", "BZ2")
    whole = path.read_bytes()
    at = whole.index(b"BZh")
    (size,) = struct.unpack_from("<L", whole, at - 4)
    bomb = bz2.compress(bytes(150 << 20))
    assert len(bomb) < size
    padded = bomb + bytes(size - len(bomb))
    path.write_bytes(whole[:at] + padded + whole[at + size :])
    assert "made to fill the memory" in refused(path)
