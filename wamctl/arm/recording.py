"""A recording of an arm, read from any ROS 2 bag with joint states."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mcap.records import Attachment, Metadata
from numpy.typing import NDArray

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.bag import parts
from wamctl.arm.ros2.joint_messages import (
    JOINT_STATE_TYPE,
    TRAJECTORY_POINT_TYPE,
    joint_series,
    reference_series,
)
from wamctl.arm.ros2.joint_series import JointSeries, ReferenceSeries, columns_of, joined
from wamctl.arm.ros2.part import Batch, Cut, Topic

Array = NDArray[np.floating]
Stamps = NDArray[np.int64]

JOINT_STATES = "/joint_states"
JOINT_COMMANDS = "/joint_commands"
JOINT_REFERENCE = "/joint_reference"


@dataclass(frozen=True)
class Command:
    """What the controller asked for: C samples of n joints.

    Attributes:
        stamp_ns: instants from which the torque acts [ns], shape (C,).
        q: reference position [rad], shape (C, n), or None.
        qd: reference velocity [rad/s], shape (C, n), or None.
        effort: commanded joint torque tau_c [N m], shape (C, n), or None.
    """

    stamp_ns: Stamps
    q: Array | None
    qd: Array | None
    effort: Array | None


@dataclass(frozen=True)
class Recording:
    """What an experiment left behind: S samples of n joints.

    Attributes:
        joint_names: the n joints, in the order of the columns.
        stamp_ns: sampling instants [ns], shape (S,), as they stand in the log.
        q: measured position [rad], shape (S, n).
        qd: estimated velocity [rad/s], shape (S, n), or None.
        effort: measured joint torque [N m], shape (S, n), or None where the drives report none.
        command: what the controller asked for, or None.
        reference: the motion that was wanted, or None.
        metadata: facts about the run.
        attachments: files inside the log (`config.yaml`, `robot.urdf`, `trajectory.yaml`).
        complete: false when the file is cut off; all whole chunks before the cut are here.
    """

    joint_names: tuple[str, ...]
    stamp_ns: Stamps
    q: Array
    qd: Array | None
    effort: Array | None
    command: Command | None = None
    reference: ReferenceSeries | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = True


@dataclass
class _Contents:
    topics: dict[str, Topic] = field(default_factory=dict)
    joints: dict[str, list[JointSeries]] = field(default_factory=dict)
    reference: list[ReferenceSeries] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = True


def read_recording(
    path: Path | str,
    joint_states: str = JOINT_STATES,
    joint_commands: str = JOINT_COMMANDS,
    joints: Sequence[str] = (),
) -> Recording:
    """The recording in a ROS 2 bag.

    Args:
        path: an `.mcap` file (whole or cut off) or a rosbag2 folder.
        joint_states: topic of the measurement.
        joint_commands: topic of the commanded torque; it may be missing.
        joints: the joints to take, in this order; messages without them (a gripper's) are left
            out. Empty: all.

    Raises:
        DataError: no bag, no samples, no torque, or joints that do not fit.
    """
    contents = _read(Path(path), joint_states, joint_commands)
    measured = _selected(path, contents, joint_states, tuple(joints))
    if measured.q is None:
        raise DataError(f"{path}: {joint_states} carries no positions.")
    command = _command(path, contents, joint_commands, measured.joint_names)
    if measured.effort is None and (command is None or command.effort is None):
        raise DataError(
            f"{path} holds no joint torque: {joint_states} has no effort, and {joint_commands} has"
            f" none either; its topics are {_listed(contents)}."
        )
    return Recording(
        measured.joint_names,
        measured.stamp_ns,
        measured.q,
        measured.qd,
        measured.effort,
        command,
        _reference(contents, len(measured.joint_names)),
        contents.metadata,
        contents.attachments,
        contents.complete,
    )


def read_blocks(
    path: Path | str, topic: str = JOINT_STATES, joints: Sequence[str] = ()
) -> Iterator[JointSeries]:
    """The joint messages of one topic, block by block, for logs that do not fit into memory.

    Raises:
        DataError: as for `read_recording`, at the block that is at fault.
    """
    wanted = tuple(joints)
    for part in parts(path, {topic}):
        if isinstance(part, Batch) and topic in part.messages:
            for series in joint_series(part.messages[topic], part.log_ns[topic]):
                wanted = wanted or series.joint_names
                if set(wanted) <= set(series.joint_names):
                    yield columns_of(series, wanted)


def _read(path: Path, states: str, commands: str) -> _Contents:
    contents = _Contents()
    for part in parts(path, {states, commands, JOINT_REFERENCE}):
        match part:
            case Topic():
                contents.topics[part.name] = part
            case Attachment():
                contents.attachments[part.name] = part.data
            case Metadata():
                contents.metadata |= part.metadata
            case Cut():
                contents.complete = False
            case Batch():
                _take(contents, part, states, commands)
    return contents


def _take(contents: _Contents, batch: Batch, states: str, commands: str) -> None:
    for topic in {states, commands}:
        if topic in batch.messages and _is(contents, topic, JOINT_STATE_TYPE):
            contents.joints.setdefault(topic, []).extend(
                joint_series(batch.messages[topic], batch.log_ns[topic])
            )
    if JOINT_REFERENCE in batch.messages and _is(contents, JOINT_REFERENCE, TRAJECTORY_POINT_TYPE):
        contents.reference += reference_series(
            batch.messages[JOINT_REFERENCE], batch.log_ns[JOINT_REFERENCE]
        )


def _is(contents: _Contents, topic: str, kind: str) -> bool:
    return contents.topics[topic].type == kind and contents.topics[topic].encoding == "cdr"


def _listed(contents: _Contents) -> str:
    return ", ".join(f"{t.name} ({t.type})" for t in contents.topics.values()) or "none"


def _selected(
    path: Path | str, contents: _Contents, topic: str, joints: tuple[str, ...]
) -> JointSeries:
    where = f"{path}: {topic}"
    blocks = contents.joints.get(topic)
    if not blocks:
        raise DataError(_nothing(path, contents, topic))
    if joints:
        fitting = [b for b in blocks if set(joints) <= set(b.joint_names)]
        if not fitting:
            names = blocks[0].joint_names
            missing = ", ".join(repr(j) for j in joints if j not in names)
            raise DataError(f"{where} has no joint {missing}; its joints are {', '.join(names)}.")
    else:
        joints, fitting = blocks[0].joint_names, blocks
        odd = next((b for b in blocks if set(b.joint_names) != set(joints)), None)
        if odd is not None:
            raise DataError(
                f"{where} changes its joints at {odd.stamp_ns[0]} ns, from {', '.join(joints)} to"
                f" {', '.join(odd.joint_names)}: name the arm's joints with --robot."
            )
    return joined([columns_of(b, joints) for b in fitting], where)


def _nothing(path: Path | str, contents: _Contents, topic: str) -> str:
    cut = "" if contents.complete else " (the file is cut off)"
    found = contents.topics.get(topic)
    if found and not _is(contents, topic, JOINT_STATE_TYPE):
        return (
            f"{path}: {topic} is a {found.type} in {found.encoding},"
            f" not a {JOINT_STATE_TYPE} in cdr."
        )
    if found:
        return f"{path}: {topic} holds no message{cut}."
    hint = " Choose one with --joint-states TOPIC." if topic == JOINT_STATES else ""
    return f"{path} has no topic {topic}{cut}; its topics are {_listed(contents)}.{hint}"


def _command(
    path: Path | str, contents: _Contents, topic: str, joints: tuple[str, ...]
) -> Command | None:
    """The command, where the topic has these joints; one that was asked for by name must."""
    blocks = contents.joints.get(topic, [])
    if topic == JOINT_COMMANDS and not any(set(joints) <= set(b.joint_names) for b in blocks):
        return None
    series = _selected(path, contents, topic, joints)
    return Command(series.stamp_ns, series.q, series.qd, series.effort)


def _reference(contents: _Contents, n: int) -> ReferenceSeries | None:
    blocks = contents.reference
    if not blocks or any(b.q.shape[1] != n for b in blocks):
        return None
    return ReferenceSeries(
        np.concatenate([b.stamp_ns for b in blocks]),
        np.concatenate([b.q for b in blocks]),
        np.concatenate([b.qd for b in blocks]),
        np.concatenate([b.qdd for b in blocks]),
    )
