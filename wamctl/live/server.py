"""The process that serves the running experiment to Foxglove, so that no viewer delays the loop.

Started as `python -m wamctl.live.server DESCRIPTOR PORT`. One line of JSON on its input says what
the log is about; it answers `ready`, or why it cannot serve, and ends with its input. Every cycle
is sent with the topics and messages that the log has, fifty times a second those since the last
time; of the drives' states and the links' places only the newest.
"""

import json
import os
import secrets
import select
import signal
import sys
from typing import Any

import foxglove
from foxglove.channels import FrameTransformsChannel
from foxglove.messages import (
    FrameTransform,
    FrameTransforms,
    Quaternion,
    Timestamp,
    Vector3,
)

from wamctl.arm.recording import JOINT_COMMANDS, JOINT_REFERENCE, JOINT_STATES
from wamctl.arm.robot import load_robot
from wamctl.arm.ros2.log_messages import DIAGNOSTICS, TOPICS, Messages
from wamctl.arm.ros2.message_definition import definition
from wamctl.live.gate import Gate
from wamctl.live.pose import Links, Placement
from wamctl.live.ring_reader import Reader, Record
from wamctl.live.watch import READY
from wamctl.telemetry import ring as shared
from wamctl.telemetry.status import diagnostics

_INTERVAL_S = 0.02
_POLITENESS = 10
_NS = 1_000_000_000


def main() -> None:
    """Serve one run."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the operator's stop is for the loop
    os.nice(_POLITENESS)
    about = json.loads(sys.stdin.buffer.readline())
    ring = shared.attach(int(sys.argv[1]), len(about["joint_names"]))
    port = int(sys.argv[2])
    inner = (
        f"127.{secrets.randbelow(254) + 1}.{secrets.randbelow(256)}.{secrets.randbelow(254) + 1}"
    )
    server = foxglove.start_server(name="wamctl", host=inner, port=0)  # found by the gate alone
    try:
        Gate((inner, server.port)).open(port)
    except OSError as error:
        why = os.strerror(error.errno or 0)
        _answer(f"--live: port {port} cannot be used ({why}); name another with --live-port.")
        return
    broadcast, reader = Broadcast(about), Reader(ring)
    _answer(READY)
    ended = False
    while not ended:
        ended = bool(select.select([sys.stdin], [], [], _INTERVAL_S)[0])
        new = reader.new()
        if new:
            broadcast.send(new, reader.first_stamp_ns())
    server.stop()


class Broadcast:
    """The topics, and what goes out on them.

    Args:
        about: joint names, drives, names of the drives' states by number, and URDF.
    """

    def __init__(self, about: dict[str, Any]) -> None:
        self._names = tuple(about["joint_names"])
        self._drives = about["drives"]
        self._state_names = {int(code): name for code, name in about["state_names"].items()}
        self._links = Links(load_robot(about["urdf"], self._names))
        self._channels = {topic: _channel(topic, kind) for topic, kind in TOPICS.items()}
        self._frames = FrameTransformsChannel("/tf")
        self._messages: Messages | None = None

    def send(self, new: dict[int, list[Record]], start_ns: int | None) -> None:
        """Send new records.

        Args:
            new: by kind, in order.
            start_ns: stamp of the log's first record [ns], where it is known.
        """
        if self._messages is None:
            self._messages = Messages(self._names, start_ns)
        for cycle in new.get(shared.CYCLE, []):
            self._send_cycle(cycle, self._messages)
        if shared.CYCLE in new:
            self._send_pose(new[shared.CYCLE][-1])
        if shared.STATUS in new:
            found = new[shared.STATUS][-1]
            entries = diagnostics(found.values, self._drives, self._state_names)
            message = self._messages.diagnostics(found.stamp_ns, entries)
            self._channels[DIAGNOSTICS].log(message, log_time=found.stamp_ns)

    def _send_cycle(self, new: Record, messages: Messages) -> None:
        n, stamp = len(self._names), new.stamp_ns
        q, qd, q_ref, qd_ref, qdd_ref, tau = new.values[: shared.COLUMNS * n].reshape(-1, n)
        for topic, arrays in (
            (JOINT_STATES, (q, qd, None)),
            (JOINT_COMMANDS, (q_ref, qd_ref, tau)),
            (JOINT_REFERENCE, (q_ref, qd_ref, qdd_ref)),
        ):
            self._channels[topic].log(messages.joints(topic, stamp, *arrays), log_time=stamp)

    def _send_pose(self, new: Record) -> None:
        q = new.values[: len(self._names)]
        transforms = [_transform(p, new.stamp_ns) for p in self._links.at(q)]
        self._frames.log(FrameTransforms(transforms=transforms), log_time=new.stamp_ns)


def _channel(topic: str, kind: str) -> foxglove.Channel:
    schema = foxglove.Schema(name=kind, encoding="ros2msg", data=definition(kind).encode())
    return foxglove.Channel(topic, schema=schema, message_encoding="cdr")


def _transform(placement: Placement, stamp_ns: int) -> FrameTransform:
    seconds, nanoseconds = divmod(stamp_ns, _NS)
    x, y, z = placement.translation.tolist()
    qx, qy, qz, qw = placement.quaternion.tolist()
    return FrameTransform(
        timestamp=Timestamp(seconds, nanoseconds),
        parent_frame_id=placement.parent,
        child_frame_id=placement.child,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    )


def _answer(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
