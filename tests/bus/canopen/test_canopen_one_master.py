"""Two programs on one bus, and an arm that changes while the operator is asked."""

import subprocess
import sys

import can
import pytest

from tests.bus.buses import on_buses, on_embedded_bus
from wamctl.arm.config import load_arm_file
from wamctl.drives.bus import parse_channel
from wamctl.drives.one_master import locked
from wamctl.errors import BusError
from wamctl.experiment.session import connected

COMMANDS = ("check", "bench", "monitor", "excite")
ALL_COMMANDS = """
import sys
from wamctl.cli import main

for command in sys.argv[1].split():
    sys.argv[:] = ["wamctl", command, *sys.argv[-4:]]
    try:
        main()
    except SystemExit as ended:
        print(ended.code)
"""


def opened(word):
    interface, channel = word.split(":")
    return can.Bus(interface=interface, channel=channel)


def foreign(can_id, data=b""):
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False)


@on_buses(
    "word",
    ("can_id",),
    (0x000, 0x080, 0x200, 0x303, 0x604, 0x77F),
    lambda can_id: can_id == 0x080,
)
def test_a_frame_of_ours_from_elsewhere_stops_the_arm_at_once(serve_arms, can_id):
    with serve_arms() as arm, opened(arm.word) as other:
        arm.witness.on_sync[600] = lambda: other.send(foreign(can_id, bytes(8 * (can_id > 0x80))))
        done = arm.excite()
        said = done.error
    assert said is not None
    assert (said.exit_code, said.cause) == (
        4,
        f"another program commands the drives on bus {arm.word}: it sent frame {can_id:#05x}",
    )
    assert len(done.recording.q) <= 605


@on_embedded_bus("word")
def test_a_second_command_is_refused_and_the_first_goes_on(serve_arms):
    with serve_arms() as arm:
        options = ["--config", str(arm.path), "--bus", arm.word]
        program = [sys.executable, "-c", ALL_COMMANDS, " ".join(COMMANDS), *options]
        refused = []

        def second(connection):
            refused.append(subprocess.run(program, capture_output=True, text=True, timeout=300))

        done = arm.excite(confirm=second)
    assert done.error is None
    assert refused[0].stdout.split() == ["4"] * len(COMMANDS)
    sentence = f"Bus {arm.word} is in use by another wamctl on this machine; nothing was sent."
    assert refused[0].stderr.splitlines() == [sentence] * len(COMMANDS)


@pytest.mark.alone
def test_a_master_elsewhere_is_heard_before_anything_is_sent(serve_arms):
    with serve_arms() as arm, opened(arm.word) as other:
        before = len(arm.witness.heard)
        channel = parse_channel(arm.word)
        other.send(foreign(0x080))
        with locked(channel), pytest.raises(BusError) as error, locked(channel):
            pass
        assert "in use by another wamctl" in str(error.value)
        speaks = Speaking(other)
        with speaks, pytest.raises(BusError) as error, connected(arm.setup):
            pass
        assert str(error.value) == (
            f"Another program commands the drives on bus {arm.word}: it sent frame 0x080. Nothing "
            "was sent."
        )
        assert {f.can_id for _, f in arm.witness.heard[before:]} == {0x080}


class Speaking:
    """A master elsewhere that sends SYNC fifty times a second."""

    def __init__(self, bus):
        self._task = None
        self._bus = bus

    def __enter__(self):
        self._task = self._bus.send_periodic(foreign(0x080), 0.02)

    def __exit__(self, *_):
        self._task.stop()
        if hasattr(self._task, "thread"):  # the kernel sends by itself
            self._task.thread.join()


def test_an_arm_that_is_moved_while_the_operator_is_asked_is_refused(serve_arms):
    with serve_arms() as arm:

        def move(connection):
            arm.simulation.arm.plant.q[1] += 0.1

        done = arm.excite(confirm=move)
    assert done.error is not None
    assert done.error.exit_code == 5
    assert "joint 2 (shoulder pitch) stands at -0.900 rad" in str(done.error)
    assert done.recording is None


def test_a_drive_that_restarts_while_the_operator_is_asked_is_refused(serve_arms):
    with serve_arms() as arm:
        node = load_arm_file(arm.path).drives.node_ids[2]

        def restart(connection):
            with opened(arm.word) as other:
                other.send(foreign(0x000, bytes([0x81, node])))
                other.recv(0.2)

        done = arm.excite(confirm=restart)
    assert done.error is not None
    assert done.error.exit_code == 4
    assert str(done.error).startswith("drive 3 (node 3): has lost its settings since its set-up")
    assert done.recording is None
