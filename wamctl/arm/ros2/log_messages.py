"""The messages of a log, topic by topic, before they go into a file or to whoever looks on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.recording import JOINT_COMMANDS, JOINT_REFERENCE, JOINT_STATES
from wamctl.arm.ros2.cdr import JOINT_STATE, TRAJECTORY_POINT, Fields, Kind, encode, layout

DIAGNOSTICS = "/diagnostics"

TOPICS = {
    JOINT_STATES: "sensor_msgs/msg/JointState",
    JOINT_COMMANDS: "sensor_msgs/msg/JointState",
    JOINT_REFERENCE: "trajectory_msgs/msg/JointTrajectoryPoint",
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
}
"""Topics of a log, and the type of their messages."""

_NS = 1_000_000_000


@dataclass(frozen=True)
class Status:
    """One component's entry of a diagnostics message.

    Attributes:
        name: the component, for instance `drive 3`.
        level: 0 fine, 1 warning, 2 error, 3 stale.
        message: its state in words.
        hardware_id: which device.
        values: further facts.
    """

    name: str
    level: int = 0
    message: str = ""
    hardware_id: str = ""
    values: Mapping[str, str] = field(default_factory=dict)


class Template:
    """Messages of one topic and form.

    Args:
        fields: of the message.
        names: joint names, where the message has them.
        lengths: number of entries of each array.
    """

    def __init__(self, fields: Fields, names: Sequence[str], lengths: Sequence[int]) -> None:
        numbers = iter(lengths)
        blank: dict[Kind, object] = {"string": "", "strings": list(names)}
        message = encode(
            (kind, [0.0] * next(numbers) if kind == "doubles" else blank.get(kind, 0))
            for _, kind in fields
        )
        slots = layout(message, fields).slots
        self._message = bytearray(message)
        self._sec, self._nanosec = slots["sec"], slots["nanosec"]
        self._arrays = [slots[name] for name, kind in fields if kind == "doubles"]

    def filled(self, time_ns: int, arrays: Sequence[Array | None]) -> bytes:
        """The message with this time [ns] and these arrays."""
        seconds, nanoseconds = divmod(time_ns, _NS)
        message = self._message
        message[self._sec] = seconds.to_bytes(4, "little", signed=True)
        message[self._nanosec] = nanoseconds.to_bytes(4, "little")
        for slot, array in zip(self._arrays, arrays, strict=False):
            if array is not None:
                message[slot] = np.asarray(array, dtype="<f8").tobytes()
        return bytes(message)


class Messages:
    """Encodes messages in CDR.

    Args:
        joint_names: names of the n joints.
        start_ns: stamp of the log's first message [ns]; None: that of the first one encoded here.
    """

    def __init__(self, joint_names: Sequence[str], start_ns: int | None = None) -> None:
        self._names = list(joint_names)
        self._start_ns = start_ns
        self._templates: dict[tuple[str, tuple[int, ...]], Template] = {}

    def joints(self, topic: str, stamp_ns: int, *arrays: Array | None) -> bytes:
        """A message of one of the joint topics: its first three arrays, None for an empty one."""
        key = (topic, tuple([0 if a is None else len(a) for a in arrays]))
        template = self._templates.get(key)
        if template is None:
            template = self._templates[key] = self._template(*key)
        if self._start_ns is None:
            self._start_ns = stamp_ns
        time_ns = stamp_ns - self._start_ns if topic == JOINT_REFERENCE else stamp_ns
        return template.filled(time_ns, arrays)

    def _template(self, topic: str, lengths: tuple[int, ...]) -> Template:
        if topic == JOINT_REFERENCE:
            return Template(TRAJECTORY_POINT, [], (*lengths, 0))
        return Template(JOINT_STATE, self._names, lengths)

    def diagnostics(self, stamp_ns: int, statuses: Sequence[Status]) -> bytes:
        """A message about drives, bus and loop."""
        if self._start_ns is None:
            self._start_ns = stamp_ns
        return encode(_diagnostic_array(stamp_ns, statuses))


def _diagnostic_array(stamp_ns: int, statuses: Sequence[Status]) -> list[tuple[Kind, object]]:
    """The fields of diagnostic_msgs/msg/DiagnosticArray in a row."""
    row: list[tuple[Kind, object]] = [
        ("int32", stamp_ns // _NS),
        ("uint32", stamp_ns % _NS),
        ("string", ""),
        ("uint32", len(statuses)),
    ]
    for status in statuses:
        row.append(("byte", status.level))
        row.extend(("string", t) for t in (status.name, status.message, status.hardware_id))
        row.append(("uint32", len(status.values)))
        row.extend(("string", text) for pair in status.values.items() for text in pair)
    return row
