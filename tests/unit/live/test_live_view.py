"""The live view: what a viewer gets is what the log has, and the log does not notice."""

import json
import os
import signal
import socket
import struct
import sys
from contextlib import contextmanager
from functools import partial

import numpy as np
import pinocchio as pin
import psutil
import pytest
from mcap.reader import make_reader
from websockets.sync.client import connect

from wamctl.arm.config import find_file, load_arm_file
from wamctl.arm.control import Setpoint
from wamctl.arm.recording import read_recording
from wamctl.arm.robot import load_robot
from wamctl.cli import main
from wamctl.errors import UsageError
from wamctl.live.pose import Links
from wamctl.live.ring_reader import Reader
from wamctl.live.watch import live_view
from wamctl.telemetry import ring as shared
from wamctl.telemetry.logger import LogHead, recorded
from wamctl.telemetry.status import LoopStatus

JOINTS = load_arm_file("wam7.yaml").robot.joints
URDF = find_file("wam7.urdf").read_text()
START_NS = 1_700_000_000_000_000_000
STATUS = LoopStatus(3, 100, 1, 2, 3, 4, 55.4, 234.6, 7)
LOGGED = {"/joint_states", "/joint_commands", "/joint_reference", "/diagnostics"}


def head(path):
    drives = tuple(f"drive {k}" for k in range(1, 8))
    return LogHead(path, JOINTS, drives, {8: "FAULT"}, {}, {"robot.urdf": URDF.encode()})


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def fill(log, cycles):
    """The next rows of a made-up motion, with the status of the loop at every tenth."""
    for k in range(log.rows, log.rows + cycles):
        stamp = START_NS + 2_000_000 * k
        row = np.sin(0.01 * k + np.arange(7))
        log.cycle(stamp, row, row + 1, Setpoint(row + 2, row + 3, row + 4), row + 5)
        if k % 10 == 0:
            log.status(stamp, STATUS, [8] * 7)


@contextmanager
def viewing(port):
    """A client of Foxglove's WebSocket protocol that subscribes to everything."""
    with connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]) as end:
        channels = {}
        while len(channels) < len(LOGGED) + 1:
            message = json.loads(end.recv(timeout=10))
            channels |= {c["id"]: c for c in message.get("channels", [])}
        wanted = [{"id": k, "channelId": k} for k in channels]
        end.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        yield Viewer(end, channels)


class Viewer:
    """The client's end of the connection."""

    def __init__(self, end, channels):
        self._end, self.channels = end, channels

    def next(self):
        """Topic, stamp and bytes of the next message; None where none comes for a moment."""
        try:
            message = self._end.recv(timeout=0.1)
        except TimeoutError:
            return None
        assert isinstance(message, bytes)
        _, channel, stamp = struct.unpack_from("<BIQ", message)
        return self.channels[channel]["topic"], stamp, message[13:]


def seen_of_each(viewer, log, least):
    """Messages by topic and stamp: rows are written, and read, until each topic has so many."""
    seen = {}
    while len(seen) < len(LOGGED) + 1 or min(map(len, seen.values())) < least:
        fill(log, 5)
        while (found := viewer.next()) is not None:
            topic, stamp, data = found
            seen.setdefault(topic, {})[stamp] = data
    return seen


def logged(path):
    with path.open("rb") as stream:
        found = make_reader(stream).iter_messages()
        return {(channel.topic, m.log_time): m.data for _, channel, m in found}


def test_a_viewer_gets_every_cycle_with_the_messages_that_the_log_has(tmp_path):
    path, port = tmp_path / "log.mcap", free_port()
    view = partial(live_view, port=port)
    with recorded(head(path), waits=True, shown=False, live_views=[view]) as log:
        fill(log, 100)
        with viewing(port) as viewer:
            seen = seen_of_each(viewer, log, least=5)
    kinds = {c["topic"]: (c["encoding"], c["schemaName"]) for c in viewer.channels.values()}
    assert kinds["/joint_states"] == ("cdr", "sensor_msgs/msg/JointState")
    assert set(seen) == LOGGED | {"/tf"}
    assert set(np.diff(sorted(seen["/joint_commands"]))) == {2_000_000}
    written = logged(path)
    for topic in LOGGED:
        for stamp, data in seen[topic].items():
            assert data == written[topic, stamp]


def test_the_log_is_the_same_with_and_without_a_view(tmp_path):
    paths = [tmp_path / "seen.mcap", tmp_path / "unseen.mcap"]
    for path, live_views in zip(paths, ([partial(live_view, port=free_port())], []), strict=True):
        with recorded(head(path), waits=True, shown=False, live_views=live_views) as log:
            fill(log, 2000)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_view_that_dies_leaves_the_log_alone(tmp_path):
    path = tmp_path / "log.mcap"
    view = partial(live_view, port=free_port())
    with recorded(head(path), waits=True, shown=False, live_views=[view]) as log:
        fill(log, 100)
        (view,) = [
            p for p in psutil.Process().children() if "wamctl.live.server" in " ".join(p.cmdline())
        ]
        os.kill(view.pid, signal.SIGKILL)
        fill(log, 4500)
    assert len(read_recording(path).q) == 4600


def test_a_port_in_use_is_refused_before_there_is_a_log(tmp_path):
    path = tmp_path / "log.mcap"
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        view = partial(live_view, port=port)
        with (
            pytest.raises(UsageError) as error,
            recorded(head(path), waits=True, shown=False, live_views=[view]),
        ):
            pass
    assert str(error.value) == (
        f"--live: port {port} cannot be used (Address already in use); name another with"
        " --live-port."
    )
    assert not path.exists()


def test_without_the_library_the_command_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    monkeypatch.setattr(sys, "argv", ["wamctl", "excite", "--config", "wam7.yaml", "--live"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert capsys.readouterr().err == (
        "--live needs foxglove-sdk, which is not installed: pip install 'wam-ident[live]'.\n"
    )


def test_transforms_put_the_links_where_the_arm_has_them():
    robot = load_robot(URDF, JOINTS)
    q = np.random.default_rng(0).uniform(-1, 1, 7)
    placements = Links(robot).at(q)
    data = robot.data()
    pin.framesForwardKinematics(robot.model, data, q)
    places = {placements[0].parent: pin.SE3.Identity()}
    for one in placements:
        turn = pin.Quaternion(*one.quaternion[[3, 0, 1, 2]])
        places[one.child] = places[one.parent] * pin.SE3(turn, one.translation)
        found = data.oMf[robot.model.getFrameId(one.child)]
        np.testing.assert_allclose(places[one.child].homogeneous, found.homogeneous, atol=1e-12)
    assert len(places) == 8


def test_the_reader_takes_nothing_and_sees_all_that_is_new():
    with shared.created(2) as (_, ring):
        reader = Reader(ring)
        assert reader.new() == {}
        assert reader.first_stamp_ns() is None
        for k, kind in enumerate((shared.CYCLE, shared.STATUS, shared.CYCLE)):
            ring.kinds[k], ring.stamps_ns[k], ring.values[k] = kind, 10 + k, k
        ring.header[shared.PRODUCED] = 3
        new = reader.new()
        assert {kind: [r.stamp_ns for r in found] for kind, found in new.items()} == {
            shared.CYCLE: [10, 12],
            shared.STATUS: [11],
        }
        assert new[shared.CYCLE][1].values[0] == 2.0
        assert reader.first_stamp_ns() == 10
        assert reader.new() == {}
        assert ring.header[shared.CONSUMED] == 0
