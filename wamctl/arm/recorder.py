"""The log as a ROS 2 bag: one joint message a topic a cycle, in chunks that survive a cut."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from mcap.writer import Writer

from wamctl.arm.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.recording import JOINT_COMMANDS, JOINT_REFERENCE, JOINT_STATES, Recording
from wamctl.arm.ros2.log_messages import DIAGNOSTICS, TOPICS, Messages, Status
from wamctl.arm.ros2.message_definition import definition

CHUNK_NS = 300_000_000
"""A chunk is closed when it spans this much time [ns], so that a cut loses no more."""

_LARGEST_CHUNK = 2**24


@dataclass(frozen=True)
class CycleRecord:
    """What is logged of one cycle; arrays of shape (n,).

    Attributes:
        stamp_ns: sampling instant (SYNC) [ns].
        q: measured position [rad].
        qd: estimated velocity [rad/s], or None.
        effort: measured joint torque [N m], or None where the drives report none.
        q_ref: reference position [rad].
        qd_ref: reference velocity [rad/s].
        qdd_ref: reference acceleration [rad/s^2].
        tau_cmd: commanded torque that acts from this instant on [N m].
    """

    stamp_ns: int
    q: Array
    qd: Array | None
    effort: Array | None
    q_ref: Array
    qd_ref: Array
    qdd_ref: Array
    tau_cmd: Array


class Recorder:
    """Writes a log, readable up to its last whole chunk wherever it is cut.

    The bytes depend on nothing but the calls: no clock, no host name. Not for use inside the
    control loop, since closing a chunk takes milliseconds.

    Args:
        path: the file to write; one that exists is replaced.
        joint_names: names of the n joints.
        metadata: facts about the run (versions, commit, seed).
        attachments: files that travel inside the log, by name (`config.yaml`, `robot.urdf`,
            `trajectory.yaml`).

    Raises:
        DataError: the file cannot be written; also from every later call, when the disk is full.
    """

    def __init__(
        self,
        path: Path | str,
        joint_names: Sequence[str],
        metadata: Mapping[str, str] | None = None,
        attachments: Mapping[str, bytes] | None = None,
    ) -> None:
        self._path = Path(path)
        self._messages = Messages(joint_names)
        self._chunk_ns: int | None = None
        self._counts = dict.fromkeys(TOPICS, 0)
        try:
            self._file = self._path.open("wb")
        except OSError as error:
            raise DataError(_unwritable(self._path, error)) from error
        # Chunks end by time; the size is only a bound.
        self._writer = Writer(self._file, chunk_size=_LARGEST_CHUNK, enable_data_crcs=True)
        try:
            self._writer.start(profile="ros2", library="wam-ident")
            self._channels = self._registered()
            self._writer.add_metadata("wam-ident", dict(metadata or {}))
            for name, data in (attachments or {}).items():
                media = "application/xml" if name.endswith(".urdf") else "application/yaml"
                self._writer.add_attachment(0, 0, name, media, data)
            self._file.flush()
        except OSError as error:
            self._give_up(error)

    def _registered(self) -> dict[str, int]:
        """Channel of each topic."""
        schemas = {
            kind: self._writer.register_schema(kind, "ros2msg", definition(kind).encode())
            for kind in dict.fromkeys(TOPICS.values())
        }
        return {
            topic: self._writer.register_channel(topic, "cdr", schemas[kind])
            for topic, kind in TOPICS.items()
        }

    def cycle(self, record: CycleRecord) -> None:
        """One cycle of the experiment: measurement, command and reference of the same instant."""
        wanted = (record.q_ref, record.qd_ref)
        self.joint_states(record.stamp_ns, record.q, record.qd, record.effort)
        self.add(JOINT_COMMANDS, record.stamp_ns, *wanted, record.tau_cmd)
        self.add(JOINT_REFERENCE, record.stamp_ns, *wanted, record.qdd_ref)

    def joint_states(
        self, stamp_ns: int, q: Array, qd: Array | None = None, effort: Array | None = None
    ) -> None:
        """A measurement: position [rad], velocity [rad/s], joint torque [N m], shape (n,) each."""
        self.add(JOINT_STATES, stamp_ns, q, qd, effort)

    def diagnostics(self, stamp_ns: int, statuses: Sequence[Status]) -> None:
        """The states of drives, bus and loop."""
        self._write(DIAGNOSTICS, stamp_ns, self._messages.diagnostics(stamp_ns, statuses))

    def add(self, topic: str, stamp_ns: int, *arrays: Array | None) -> None:
        """A message on one of the joint topics: its first three arrays, None for an empty one."""
        self._write(topic, stamp_ns, self._messages.joints(topic, stamp_ns, *arrays))

    def _write(self, topic: str, stamp_ns: int, message: bytes) -> None:
        if self._chunk_ns is None:
            self._chunk_ns = stamp_ns
        try:
            if abs(stamp_ns - self._chunk_ns) >= CHUNK_NS:
                self._writer.flush()
                self._chunk_ns = stamp_ns
            self._writer.add_message(
                self._channels[topic], stamp_ns, message, stamp_ns, self._counts[topic]
            )
        except OSError as error:
            self._give_up(error)
        self._counts[topic] += 1

    def close(self) -> None:
        """Ends the last chunk and writes the index."""
        if not self._file.closed:
            try:
                self._writer.finish()
                self._file.close()
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error: OSError) -> NoReturn:
        with suppress(OSError):
            self._file.close()
        raise DataError(_unwritable(self._path, error)) from error

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()


def write_recording(path: Path | str, recording: Recording) -> None:
    """Writes a whole recording as a log.

    Raises:
        DataError: the file cannot be written.
    """
    columns: dict[str, tuple[Array | None, ...]] = {
        JOINT_STATES: (recording.q, recording.qd, recording.effort)
    }
    stamps_ns = {JOINT_STATES: recording.stamp_ns}
    if (command := recording.command) is not None:
        columns[JOINT_COMMANDS] = (command.q, command.qd, command.effort)
        stamps_ns[JOINT_COMMANDS] = command.stamp_ns
    if (reference := recording.reference) is not None:
        columns[JOINT_REFERENCE] = (reference.q, reference.qd, reference.qdd)
        stamps_ns[JOINT_REFERENCE] = reference.stamp_ns
    rows = [(t, topic, k) for topic in columns for k, t in enumerate(stamps_ns[topic].tolist())]
    facts = (recording.joint_names, recording.metadata, recording.attachments)
    with Recorder(path, *facts) as recorder:
        for stamp, topic, k in sorted(rows, key=lambda row: row[0]):
            recorder.add(topic, stamp, *(None if c is None else c[k] for c in columns[topic]))


def _unwritable(path: Path, error: OSError) -> str:
    return f"The log {path} cannot be written ({error.strerror})."
