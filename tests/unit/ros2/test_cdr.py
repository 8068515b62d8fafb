"""Our CDR against rosbags' serialiser, which knows nothing of ours."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from wamctl.arm.ros2.cdr import JOINT_STATE, TRAJECTORY_POINT, columns, encode, layout
from wamctl.arm.ros2.joint_messages import joint_series, reference_series
from wamctl.arm.ros2.log_messages import Status, _diagnostic_array

STORE = get_typestore(Stores.LATEST)
numbers = st.floats(allow_nan=False)
names = st.lists(st.text(min_size=1, max_size=9).filter(lambda t: "\0" not in t), max_size=4)


def joint_state(
    name: list[str], q: Any, qd: Any, effort: Any, stamp_ns: int = 0, *, little_endian: bool = True
) -> bytes:
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 1_000_000_000))
    header = types["std_msgs/msg/Header"](stamp, "base")
    arrays = [np.array(a, dtype=float) for a in (q, qd, effort)]
    message = types["sensor_msgs/msg/JointState"](header, name, *arrays)
    kind = "sensor_msgs/msg/JointState"
    return bytes(STORE.serialize_cdr(message, kind, little_endian=little_endian))


def test_a_joint_state_is_encoded_as_rosbags_does() -> None:
    name, q, qd, effort = ["a", "long name"], [1.0, 2.0], [], [-1.0, 1e300]
    ours = encode(
        [
            ("int32", 12),
            ("uint32", 34),
            ("string", "base"),
            ("strings", name),
            ("doubles", q),
            ("doubles", qd),
            ("doubles", effort),
        ]
    )
    assert ours == joint_state(name, q, qd, effort, 12_000_000_034)


@given(names, st.lists(numbers, max_size=5), st.lists(numbers, max_size=5), st.integers(0, 2**60))
@settings(max_examples=200, deadline=None)
def test_layout_finds_the_numbers(
    name: list[str], q: list[float], effort: list[float], stamp_ns: int
) -> None:
    message = joint_state(name, q, [], effort, stamp_ns)
    found = columns([message, message], JOINT_STATE)
    assert found is not None
    shape, column = found
    assert shape.texts == {"frame_id": ("base",), "name": tuple(name)}
    np.testing.assert_array_equal(column["position"], [q, q])
    np.testing.assert_array_equal(column["effort"], [effort, effort])
    assert column["velocity"].shape == (2, 0)
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    assert column["sec"].tolist() == [[seconds], [seconds]]
    assert column["nanosec"].tolist() == [[rest], [rest]]


@given(st.lists(st.builds(Status, st.text(), st.integers(0, 3), st.text(), st.text(),
       st.dictionaries(st.text(), st.text(), max_size=3)), max_size=3))  # fmt: skip
@settings(max_examples=100, deadline=None)
def test_diagnostics_are_encoded_as_rosbags_does(statuses: list[Status]) -> None:
    types = STORE.types
    pair = types["diagnostic_msgs/msg/KeyValue"]
    stamp = types["builtin_interfaces/msg/Time"](7, 8)
    message = types["diagnostic_msgs/msg/DiagnosticArray"](
        types["std_msgs/msg/Header"](stamp, ""),
        [
            types["diagnostic_msgs/msg/DiagnosticStatus"](
                s.level, s.name, s.message, s.hardware_id, [pair(k, v) for k, v in s.values.items()]
            )
            for s in statuses
        ],
    )
    theirs = STORE.serialize_cdr(message, "diagnostic_msgs/msg/DiagnosticArray")
    assert encode(_diagnostic_array(7_000_000_008, statuses)) == bytes(theirs)


def test_messages_of_another_layout_are_told_apart() -> None:
    one = joint_state(["a", "b"], [1, 2], [], [])
    other_name = joint_state(["a", "c"], [1, 2], [], [])
    other_array = joint_state(["a", "b"], [], [], [1, 2])
    assert len(one) == len(other_name) == len(other_array)
    assert columns([one, other_name], JOINT_STATE) is None
    assert columns([one, other_array], JOINT_STATE) is None
    assert columns([one, joint_state(["a", "b"], [3, 4], [], [])], JOINT_STATE) is not None


def test_garbage_between_the_fields_does_not_matter() -> None:
    clean = joint_state(["a"], [1.0], [], [])
    free = ~layout(clean, JOINT_STATE).fixed
    for slot in layout(clean, JOINT_STATE).slots.values():
        free[slot] = False
    assert free.any()
    dirty = bytearray(clean)
    for place in np.flatnonzero(free):
        dirty[place] = 0xAA
    found = columns([clean, bytes(dirty)], JOINT_STATE)
    assert found is not None
    assert found[1]["position"].tolist() == [[1.0], [1.0]]


@pytest.mark.parametrize("length", [3, 4, 10, 30, 60])
def test_a_short_message_is_refused(length: int) -> None:
    with pytest.raises(ValueError, match=r"plain little-endian CDR|ends too early"):
        layout(joint_state(["a"], [1.0], [2.0], [3.0])[:length], JOINT_STATE)


def test_a_huge_count_is_refused() -> None:
    message = bytearray(joint_state(["a"], [1.0], [2.0], [3.0]))
    start = layout(bytes(message), JOINT_STATE).slots["position"].start
    count = next(p for p in range(start - 8, start, 4) if message[p] == 1)
    struct.pack_into("<I", message, count, 2**31)
    with pytest.raises(ValueError, match="ends too early"):
        layout(bytes(message), JOINT_STATE)


def test_both_ways_of_reading_agree() -> None:
    rng = np.random.default_rng(3)
    name = ["x", "yy", "zzz"]
    rows = rng.normal(size=(50, 3, 3))
    stamps = [10**18 + k * 2_000_000 for k in range(50)]
    little = [joint_state(name, *row, stamp) for row, stamp in zip(rows, stamps, strict=True)]
    big = [
        joint_state(name, *row, stamp, little_endian=False)
        for row, stamp in zip(rows, stamps, strict=True)
    ]
    (fast,), (slow,) = joint_series(little, stamps), joint_series(big, stamps)
    assert fast.joint_names == slow.joint_names == tuple(name)
    for one, other in ((fast.q, slow.q), (fast.qd, slow.qd), (fast.effort, slow.effort)):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(fast.stamp_ns, stamps)
    np.testing.assert_array_equal(slow.stamp_ns, stamps)


def test_both_ways_of_reading_points_agree() -> None:
    rows = np.random.default_rng(4).normal(size=(20, 3, 2))
    point = STORE.types["trajectory_msgs/msg/JointTrajectoryPoint"]
    duration = STORE.types["builtin_interfaces/msg/Duration"]
    kind = "trajectory_msgs/msg/JointTrajectoryPoint"
    messages = [point(*row, np.zeros(0), duration(1, 2)) for row in rows]
    little, big = (
        [bytes(STORE.serialize_cdr(m, kind, little_endian=e)) for m in messages]
        for e in (True, False)
    )
    assert columns(little, TRAJECTORY_POINT) is not None
    fast, slow = reference_series(little, range(20)), reference_series(big, range(20))
    for k, (one, other) in enumerate([(fast.q, slow.q), (fast.qd, slow.qd), (fast.qdd, slow.qdd)]):
        np.testing.assert_array_equal(one, rows[:, k])
        np.testing.assert_array_equal(other, rows[:, k])
