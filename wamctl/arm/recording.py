"""A recording of an arm, read from any ROS 2 bag with joint states: whole, or piece by piece."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from mcap.records import Attachment, Metadata
from numpy.typing import NDArray

from wamctl.arm.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.ros2.bag import parts
from wamctl.arm.ros2.joint_messages import (
    JOINT_STATE_TYPE,
    TRAJECTORY_POINT_TYPE,
    joint_series,
    reference_series,
)
from wamctl.arm.ros2.joint_series import JointSeries, ReferenceSeries, joined
from wamctl.arm.ros2.joint_topic import JointTopic
from wamctl.arm.ros2.joint_trajectory import TRAJECTORY_TYPE, CommandedMotion
from wamctl.arm.ros2.magnitudes import POSITION, excess
from wamctl.arm.ros2.part import Batch, Cut, Topic

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
class Piece:
    """A part of a recording, as it stands in the log: some messages of each topic.

    Attributes:
        states: what was measured.
        commands: what the controller asked for, the same joints.
        reference: the motion that was wanted.
        metadata, attachments: those that stand in this part of the log.
        complete: false when the file is cut off here.
    """

    states: JointSeries | None = None
    commands: JointSeries | None = None
    reference: ReferenceSeries | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = True


@dataclass(frozen=True)
class Recording(JointSeries):
    """What an experiment left behind: S samples of n joints, as they stand in the log.

    Attributes:
        q: measured position [rad], shape (S, n).
        command: what the controller asked for, or None.
        reference: the motion that was wanted, or None.
        metadata: facts about the run.
        attachments: files inside the log (`config.yaml`, `robot.urdf`, `trajectory.yaml`).
        complete: false when the file is cut off; all whole chunks before the cut are here.
    """

    q: Array
    command: Command | None = None
    reference: ReferenceSeries | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = True

    def __repr__(self) -> str:
        """Its size, without the arrays."""
        return f"<Recording: {len(self.joint_names)} joints, {len(self.stamp_ns)} samples>"

    def pieces(self) -> Iterator[Piece]:
        """The recording as one piece."""
        names, c = self.joint_names, self.command
        yield Piece(
            JointSeries(names, self.stamp_ns, self.q, self.qd, self.effort),
            None if c is None else JointSeries(names, c.stamp_ns, c.q, c.qd, c.effort),
            self.reference,
            self.metadata,
            self.attachments,
            self.complete,
        )


@dataclass(frozen=True)
class LogFile:
    """A log on disk, and what to read of it.

    Attributes:
        path: an `.mcap` file (whole or cut off) or a rosbag2 folder.
        joint_states: topic of the measurement.
        joint_commands: topic of the commanded torque or position, a JointState or, for positions,
            a JointTrajectory; it may be missing.
        joints: the joints to take, in this order; messages without them (a gripper's) are left
            out. Empty: all.
        renamed: joints as the messages name them, each with the name to give it.
        torque: whether a log without torque is refused.
    """

    path: Path
    joint_states: str = JOINT_STATES
    joint_commands: str = JOINT_COMMANDS
    joints: tuple[str, ...] = ()
    renamed: tuple[tuple[str, str], ...] = ()
    torque: bool = True

    def pieces(self) -> Iterator[Piece]:
        """The log from its start, piece by piece, so that memory does not grow with its length.

        Raises:
            DataError: no bag, no samples, no torque, or joints that do not fit; where only the end
                of the file can tell, there.
        """
        return _Pass(self).pieces()


def read_recording(
    path: Path | str,
    joint_states: str = JOINT_STATES,
    joint_commands: str = JOINT_COMMANDS,
    joints: Sequence[str] = (),
    renamed: tuple[tuple[str, str], ...] = (),
    torque: bool = True,
) -> Recording:
    """The whole recording in a ROS 2 bag; arguments as for `LogFile`.

    Raises:
        DataError: no bag, no samples, no torque, or joints that do not fit.
    """
    log = LogFile(Path(path), joint_states, joint_commands, tuple(joints), renamed, torque)
    return recording_of(log.pieces())


def recording_of(pieces: Iterable[Piece]) -> Recording:
    """All pieces of a recording as one; the first with samples names the joints."""
    states, commands, references = [], [], []
    metadata, attachments, complete = {}, {}, True
    for piece in pieces:
        states += [piece.states] if piece.states else []
        commands += [piece.commands] if piece.commands else []
        references += [piece.reference] if piece.reference else []
        metadata |= piece.metadata
        attachments |= piece.attachments
        complete = complete and piece.complete
    measured, asked = joined(states), joined(commands) if commands else None
    return Recording(
        measured.joint_names,
        measured.stamp_ns,
        measured.positions,
        measured.qd,
        measured.effort,
        None if asked is None else Command(asked.stamp_ns, asked.q, asked.qd, asked.effort),
        _reference(references, len(measured.joint_names)),
        metadata,
        attachments,
        complete,
    )


def _reference(blocks: list[ReferenceSeries], n: int) -> ReferenceSeries | None:
    if not blocks or any(b.q.shape[1] != n for b in blocks):
        return None
    return ReferenceSeries(
        np.concatenate([b.stamp_ns for b in blocks]),
        np.concatenate([b.q for b in blocks]),
        np.concatenate([b.qd for b in blocks]),
        np.concatenate([b.qdd for b in blocks]),
    )


class _Pass:
    """One pass over a log's messages."""

    def __init__(self, log: LogFile) -> None:
        self._log = log
        self._topics: dict[str, Topic] = {}
        self._complete = True
        self._states = JointTopic(f"{log.path}: {log.joint_states}", log.joints)
        self._commands: JointTopic | None = None
        self._early: list[JointSeries] = []
        self._measured: list[JointSeries] = []
        self._motion = CommandedMotion(f"{log.path}: {log.joint_commands}")

    def pieces(self) -> Iterator[Piece]:
        log = self._log
        for part in parts(log.path, {log.joint_states, log.joint_commands, JOINT_REFERENCE}):
            match part:
                case Topic():
                    self._topics[part.name] = part
                case Attachment():
                    yield Piece(attachments={part.name: part.data})
                case Metadata():
                    yield Piece(metadata=part.metadata)
                case Cut():
                    self._complete = False
                    yield Piece(complete=False)
                case Batch():
                    yield self._piece(part)
        if self._commands is not None:
            yield Piece(commands=self._commands.taken(self._renamed(self._motion.rest())))
        self._check()

    def _piece(self, batch: Batch) -> Piece:
        log = self._log
        states = self._states.taken(self._blocks(batch, log.joint_states))
        if states is not None and states.q is None:
            raise DataError(f"{log.path}: {log.joint_states} carries no positions.")
        self._measured = [*self._measured[-1:], *([states] if states else [])]
        self._early += self._asked(batch, log.joint_commands)
        if not self._states.joints:
            return Piece(reference=self._reference(batch))
        if self._commands is None:
            self._commands = JointTopic(f"{log.path}: {log.joint_commands}", self._states.joints)
        commands, self._early = self._commands.taken(self._early), []
        return Piece(states, commands, self._reference(batch))

    def _blocks(self, batch: Batch, topic: str) -> list[JointSeries]:
        if topic not in batch.messages or not self._is(topic, JOINT_STATE_TYPE):
            return []
        return self._renamed(joint_series(batch.messages[topic], batch.log_ns[topic]))

    def _asked(self, batch: Batch, topic: str) -> list[JointSeries]:
        """Commands, of either type."""
        if topic not in batch.messages or not self._is(topic, TRAJECTORY_TYPE):
            return self._blocks(batch, topic)
        messages, log_ns = batch.messages[topic], batch.log_ns[topic]
        return self._renamed(self._motion.taken(messages, log_ns, self._where))

    def _where(self, names: tuple[str, ...], ns: int) -> Array | None:
        """Where joints, as the messages name them, were read last before an instant."""
        given = dict(self._log.renamed)
        wanted = [given.get(name, name) for name in names]
        for series in reversed(self._measured):
            k = int(np.searchsorted(series.stamp_ns, ns, side="right")) - 1
            if k >= 0 and set(wanted) <= set(series.joint_names):
                return series.positions[k, [series.joint_names.index(n) for n in wanted]]
        return None

    def _renamed(self, blocks: list[JointSeries]) -> list[JointSeries]:
        if not self._log.renamed:
            return blocks
        names = dict(self._log.renamed)
        return [
            replace(b, joint_names=tuple(names.get(n, n) for n in b.joint_names)) for b in blocks
        ]

    def _reference(self, batch: Batch) -> ReferenceSeries | None:
        topic = JOINT_REFERENCE
        if topic not in batch.messages or not self._is(topic, TRAJECTORY_POINT_TYPE):
            return None
        found = reference_series(batch.messages[topic], batch.log_ns[topic])
        if found is not None:
            q, where = found.q, f"{self._log.path}: {topic}"
            columns = [f"joint {k + 1}" for k in range(q.shape[1])]
            wrong = excess(q, POSITION, columns, lambda s: f"at {found.stamp_ns[s]} ns")
            if wrong:
                raise DataError(f"{where}: position {wrong}")
            if not np.isfinite(q).all():
                raise DataError(f"{where}: wanted positions are not finite.")
        return found

    def _is(self, topic: str, kind: str) -> bool:
        return self._topics[topic].type == kind and self._topics[topic].encoding == "cdr"

    def _check(self) -> None:
        """What only the end of the file can tell.

        Raises:
            DataError: no samples, or no torque.
        """
        log, states, commands = self._log, self._states, self._commands
        if not states.seen or commands is None:
            raise DataError(states.stranger or self._nothing(log.joint_states))
        if not commands.seen and log.joint_commands != JOINT_COMMANDS:
            raise DataError(commands.stranger or self._nothing(log.joint_commands))
        if log.torque and "efforts" not in states.carries | commands.carries:
            raise DataError(
                f"{log.path} holds no joint torque: {log.joint_states} has no effort, and"
                f" {log.joint_commands} has none either; its topics are {self._listed()}. Without"
                f" torque, commanded positions are needed: {self._other_commands()}."
            )

    def _other_commands(self) -> str:
        """What to do about commands that were not found."""
        log, kinds = self._log, (TRAJECTORY_TYPE, JOINT_STATE_TYPE)
        read = log.joint_states, log.joint_commands
        others = [n for n, t in self._topics.items() if t.type in kinds and n not in read]
        if not others:
            return "record what the arm was asked for as well"
        return f"if they are there, name their topic (--joint-commands {others[0]})"

    def _listed(self) -> str:
        return ", ".join(f"{t.name} ({t.type})" for t in self._topics.values()) or "none"

    def _nothing(self, topic: str) -> str:
        path, found = self._log.path, self._topics.get(topic)
        cut = "" if self._complete else " (the file is cut off)"
        if found and not self._is(topic, JOINT_STATE_TYPE):
            if found.type == JOINT_STATE_TYPE:
                return f"{path}: {topic} is written in {found.encoding}, not in cdr."
            return (
                f"{path}: {topic} is a {found.type}, not a {JOINT_STATE_TYPE}; write its values as"
                " a table, and import that (`ident import`)."
            )
        if found:
            return f"{path}: {topic} holds no message{cut}."
        option = "--joint-states" if topic == self._log.joint_states else "--joint-commands"
        other = any(t.type in (JOINT_STATE_TYPE, TRAJECTORY_TYPE) for t in self._topics.values())
        hint = f" Choose one with {option} TOPIC." if other else f" None is a {JOINT_STATE_TYPE}."
        return f"{path} has no topic {topic}{cut}; its topics are {self._listed()}.{hint}"
