"""Bags whose commands are trajectories: what a controller asks the joints for from them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

import ident
from ident.output_error.recordings import segments_of
from ident.recordings.loading import Reading, commanded_joints
from ident.workflows.method import method_for
from wamctl.arm.errors import DataError
from wamctl.arm.recording import read_recording

STORE = get_typestore(Stores.LATEST)
TRAJECTORY, STATE = "trajectory_msgs/msg/JointTrajectory", "sensor_msgs/msg/JointState"
JOINTS = ["a", "b"]
SECOND = 1_000_000_000


def header(seconds: float) -> Any:
    stamp = STORE.types["builtin_interfaces/msg/Time"](*divmod(round(seconds * SECOND), SECOND))
    return STORE.types["std_msgs/msg/Header"](stamp, "")


def state(seconds: float, names: list[str] = JOINTS) -> bytes:
    numbers = np.full(len(names), seconds), np.zeros(0), np.zeros(0)
    return encoded(STORE.types[STATE](header(seconds), names, *numbers), STATE)


def trajectory(seconds: float, *points: tuple[Any, ...], names: list[str] = JOINTS) -> bytes:
    """Points as time from start [s], positions and, where given, velocities."""
    kind = STORE.types["trajectory_msgs/msg/JointTrajectoryPoint"]
    duration = STORE.types["builtin_interfaces/msg/Duration"]
    nothing = np.zeros(0)
    made: Any = [
        kind(np.array(q, dtype=float), np.array(qd[0] if qd else [], dtype=float), nothing, nothing,
             duration(*divmod(round(after * SECOND), SECOND)))
        for after, q, *qd in points
    ]  # fmt: skip
    return encoded(STORE.types[TRAJECTORY](header(seconds), names, made), TRAJECTORY)


def encoded(message: Any, kind: str) -> bytes:
    return bytes(STORE.serialize_cdr(message, kind))


def bag(
    path: Path, commands: list[tuple[float, bytes]], topic: str = "/joint_commands",
    names: list[str] = JOINTS,
) -> Path:  # fmt: skip
    states = [(t, STATE, state(t, names)) for t in np.arange(1.0, 5.0, 0.02).tolist()]
    asked = [(t, TRAJECTORY, data) for t, data in commands]
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        channels = {
            kind: writer.register_channel(name, "cdr", writer.register_schema(kind, "ros2msg", b""))
            for kind, name in ((STATE, "/joint_states"), (TRAJECTORY, topic))
        }
        for t, kind, data in sorted(states + asked, key=lambda m: m[0]):
            writer.add_message(channels[kind], round(t * SECOND), data, round(t * SECOND))
        writer.finish()
    return path


def asked(path: Path, at: list[float]) -> np.ndarray:
    """What the joints were asked for at instants, held from stamp to stamp."""
    command = read_recording(path, torque=False).command
    assert command is not None
    assert command.q is not None
    assert (np.diff(command.stamp_ns) > 0).all()
    times = np.round(np.array(at) * SECOND).astype(np.int64)
    return command.q[np.searchsorted(command.stamp_ns, times, side="right") - 1]


def test_points_are_joined_by_lines_and_the_last_one_is_held(tmp_path: Path) -> None:
    data = trajectory(1.0, (0.0, [0.0, 1.0]), (2.0, [1.0, 0.0]))
    found = asked(bag(tmp_path / "a.mcap", [(1.0, data)]), [1.0, 1.5, 2.0, 3.0, 4.5])
    wanted = [[0, 1], [0.25, 0.75], [0.5, 0.5], [1, 0], [1, 0]]
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_points_with_velocities_are_joined_by_cubics(tmp_path: Path) -> None:
    def cubic(t: float) -> list[float]:
        return [t**3 - 2 * t, 1.0 - t**2]

    def rate(t: float) -> list[float]:
        return [3 * t**2 - 2, -2 * t]

    data = trajectory(1.0, *((t, cubic(t), rate(t)) for t in (0.0, 1.0, 2.5)))
    found = asked(bag(tmp_path / "a.mcap", [(1.0, data)]), [1.5, 2.3, 3.2])
    np.testing.assert_allclose(found, [cubic(t) for t in (0.5, 1.3, 2.2)], atol=1e-9)


def test_a_new_trajectory_begins_where_the_one_before_had_come(tmp_path: Path) -> None:
    first = trajectory(1.0, (0.0, [0.0, 0.0]), (2.0, [2.0, 0.0]))
    second = trajectory(2.0, (1.0, [0.0, 0.0]))
    path = bag(tmp_path / "a.mcap", [(1.0, first), (2.0, second)])
    found = asked(path, [1.99, 2.0, 2.5, 3.5])
    np.testing.assert_allclose(found[:, 0], [0.99, 1.0, 0.5, 0.0], atol=1e-9)


def test_a_stream_of_single_points_is_taken_as_it_came(tmp_path: Path) -> None:
    times = np.arange(1.0, 3.0, 0.02).tolist()
    stream = [(t, trajectory(0.0, (0.0, [t, -t]))) for t in times]  # no stamp: the log's own
    path = bag(tmp_path / "a.mcap", stream)
    np.testing.assert_allclose(asked(path, times), [[t, -t] for t in times], atol=1e-9)


def test_the_first_trajectory_begins_where_the_joints_are(tmp_path: Path) -> None:
    data = trajectory(2.0, (1.0, [0.0, 4.0]))
    found = asked(bag(tmp_path / "a.mcap", [(2.0, data)]), [2.0, 2.5, 3.0])
    np.testing.assert_allclose(found, [[2.0, 2.0], [1.0, 3.0], [0.0, 4.0]], atol=1e-9)


def test_cubics_begin_as_fast_as_the_motion_before(tmp_path: Path) -> None:
    rest = trajectory(2.0, (1.0, [4.0, 2.0], [3.0, 0.0]))  # 2 + 3 t^2 - t^3
    line = trajectory(3.0, (1.0, [8.0, 2.0]))
    bent = trajectory(3.5, (1.0, [11.0, 2.0], [6.0, 0.0]))  # 6 + 4 t + t^2
    path = bag(tmp_path / "a.mcap", [(2.0, rest), (3.0, line), (3.5, bent)])
    found = asked(path, [2.5, 3.25, 4.0])
    np.testing.assert_allclose(found[:, 0], [2.625, 5.0, 8.25], atol=1e-9)


def test_joints_that_a_message_leaves_out_stay_where_they_are(tmp_path: Path) -> None:
    both = trajectory(1.0, (0.0, [0.0, 0.0]), (1.0, [1.0, 2.0]))
    one = trajectory(2.0, (1.0, [5.0]), names=["b"])
    gripper = trajectory(3.5, (0.5, [0.0, 4.0, 9.0]), names=["a", "b", "gripper"])
    path = bag(tmp_path / "a.mcap", [(1.0, both), (2.0, one), (3.5, gripper)])
    found = asked(path, [1.5, 2.5, 3.2, 4.5])
    np.testing.assert_allclose(found[:3], [[0.5, 1.0], [1.0, 3.5], [1.0, 5.0]], atol=1e-9)


def test_a_gripper_of_which_only_positions_are_known_is_left_out(tmp_path: Path) -> None:
    """A controller of its own moves it, and a driver of all tells where it is."""
    data = trajectory(1.0, (0.0, [0.0, 1.0]), (2.0, [1.0, 0.0]))
    path = bag(tmp_path / "a.mcap", [(1.0, data)], names=[*JOINTS, "finger"])
    joints, _ = commanded_joints(path, None, Reading())
    assert joints == ("a", "b")
    assert method_for([path], None, Reading())[0] == "simulation"
    log = read_recording(path, joints=joints, torque=False)
    assert segments_of(log, JOINTS, "a")[0].motion.command[0] == pytest.approx([0.0, 1.0])


def test_a_gripper_that_only_commands_name_is_no_hindrance(tmp_path: Path) -> None:
    times = np.arange(1.0, 3.0, 0.02).tolist()
    names = [*JOINTS, "gripper"]
    stream = [
        (t, trajectory(t, (0.04, [t, 1.0, 0.0][: 2 + k % 2]), names=names[: 2 + k % 2]))
        for k, t in enumerate(times)
    ]
    found = asked(bag(tmp_path / "a.mcap", stream), [1.5, 2.5])
    np.testing.assert_allclose(found[:, 0], [1.5, 2.5], atol=0.05)


def test_a_stream_of_points_that_lie_ahead_is_followed(tmp_path: Path) -> None:
    times = np.arange(1.0, 3.0, 0.02).tolist()
    stream = [(t, trajectory(t, (0.04, [np.sin(t + 0.04), 1.0]))) for t in times]
    found = asked(bag(tmp_path / "a.mcap", stream), [1.5, 2.0, 2.5])
    np.testing.assert_allclose(found[:, 0], np.sin([1.5, 2.0, 2.5]), atol=0.05)


def test_positions_before_the_first_command_are_left_out(tmp_path: Path) -> None:
    late = bag(tmp_path / "a.mcap", [(2.0, trajectory(2.0, (0.5, [1.0, 1.0])))])
    (stretch,) = segments_of(read_recording(late, torque=False), JOINTS, "a")
    assert stretch.q[0] == pytest.approx([2.0, 2.0])
    after = bag(tmp_path / "b.mcap", [(9.0, trajectory(9.0, (0.5, [1.0, 1.0])))])
    with pytest.raises(DataError, match=r"first command is stamped 8 s after its first position"):
        segments_of(read_recording(after, torque=False), JOINTS, "b")


def test_other_joints_commands_are_passed_over_and_a_simulation_gets_its_own(
    tmp_path: Path,
) -> None:
    mine = trajectory(1.0, (0.0, [0.0, 1.0]), (2.0, [1.0, 0.0]), names=["b", "a"])
    other = trajectory(1.5, (0.0, [7.0]), names=["gripper"])
    path = bag(tmp_path / "a.mcap", [(1.0, mine), (1.5, other)])
    log = read_recording(path, torque=False)
    (stretch,) = segments_of(log, JOINTS, "a")
    assert stretch.motion.command[0] == pytest.approx([1.0, 0.0])
    assert stretch.motion.command[-1] == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        ([(0.0, [1.0])], "has 2 names and a point of 1 positions and 0 velocities."),
        ([(1.0, [0, 0]), (0.5, [1, 1])], "has a point 0.5 s from its start: points have to"),
        ([(1e5, [0, 0])], "has a point 100000 s from its start: points have to"),
    ],
)
def test_points_that_cannot_be_followed(tmp_path: Path, points: list, sentence: str) -> None:
    path = bag(tmp_path / "a.mcap", [(1.0, trajectory(1.0, *points))])
    with pytest.raises(DataError) as caught:
        read_recording(path, torque=False)
    assert f"{path}: /joint_commands: the JointTrajectory at 1000000000 ns" in str(caught.value)
    assert sentence in str(caught.value)


def test_a_bag_with_commands_elsewhere_says_how_to_name_them(tmp_path: Path) -> None:
    topic, data = "/arm/joint_trajectory", trajectory(1.0, (0.0, [0.0, 0.0]))
    path = bag(tmp_path / "a.mcap", [(1.0, data)], topic)
    with pytest.raises(DataError, match=rf"name their topic \(--joint-commands {topic}\)"):
        read_recording(path)


def test_python_names_the_topic_of_commands(tmp_path: Path) -> None:
    topic, data = "/arm/joint_trajectory", trajectory(1.0, (0.0, [0.0, 0.5]))
    path = bag(tmp_path / "a.mcap", [(1.0, data)], topic)
    made = ident.Recording.from_bag(path, joint_commands=topic)
    assert made.log.command is not None
    assert made.log.command.q is not None
    assert made.log.command.q[-1].tolist() == [0.0, 0.5]
