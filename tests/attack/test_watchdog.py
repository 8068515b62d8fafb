"""A process that holds nothing but the bus takes torque away when the loop no longer can."""

import json
import os
import socket
import struct
import subprocess
import sys

import can
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame

from wamctl.safety.watchdog import NOBODY_WATCHES, WatchedHeart, silence_s, watched
from wamctl.safety.watchdog_process import HEART_BYTES

OFF = can.Message(arbitration_id=0x200, is_extended_id=False, data=bytes(8))
NMT = can.Message(arbitration_id=0, is_extended_id=False, data=b"\x80\x01")
SAID = [(0x200, bytes(8)), (0, b"\x80\x01")]
SOON_S, NEVER_S, DEADLINE_S = 0.05, 600.0, 60.0


class Wire:
    """A bus whose other end the test holds."""

    def __init__(self):
        self.near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.far.settimeout(DEADLINE_S)

    def fileno(self):
        return self.near.fileno()

    def heard(self, count):
        packets = [struct.unpack("=IB3x8s", self.far.recv(128)) for _ in range(count)]
        return [(can_id, data[:length]) for can_id, length, data in packets]

    @property
    def is_silent(self):
        self.near.close()
        return self.far.recv(128) == b""


@pytest.fixture
def wire():
    found = Wire()
    yield found
    found.near.close()
    found.far.close()


def test_a_loop_that_stands_still_loses_its_torque(wire):
    with watched(wire, [OFF, NMT], SOON_S) as heart:
        heart.begin()
        assert wire.heard(4) == 2 * SAID
        assert heart.has_been_taken_for_dead


def test_a_loop_that_beats_or_rests_is_left_alone(wire):
    with watched(wire, [OFF, NMT], NEVER_S) as heart:
        heart.begin()
        heart.beat()
        heart.rest()
    assert not heart.has_been_taken_for_dead
    assert wire.is_silent


def test_a_heart_that_rests_may_stand_still(wire):
    with watched(wire, [OFF], SOON_S) as heart:
        heart.begin()
        heart.rest()
        wire.far.settimeout(20 * SOON_S)
        with pytest.raises(TimeoutError):
            wire.heard(1)


@pytest.mark.parametrize("driven", [True, False])
def test_a_loop_that_is_killed_loses_its_torque_at_once(wire, driven):
    memory = os.memfd_create("heart")
    os.ftruncate(memory, HEART_BYTES)
    heart = WatchedHeart(memory)
    if driven:
        heart.begin()
    words = [str(memory), str(wire.fileno())]
    with subprocess.Popen(
        [sys.executable, "-P", "-m", "wamctl.safety.watchdog_process", *words],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, pass_fds=[memory, wire.fileno()], bufsize=0,
    ) as process:  # fmt: skip
        about = {"frames": [build_can_frame(f).hex() for f in (OFF, NMT)], "silence_s": NEVER_S}
        process.stdin.write(json.dumps(about).encode() + b"\n")
        assert process.stdout.readline() == b"ready\n"
        process.stdin.close()
        assert process.wait(DEADLINE_S) == 0
    os.close(memory)
    assert heart.has_been_taken_for_dead == driven
    if driven:
        assert wire.heard(2) == SAID
    else:
        assert wire.is_silent


def test_what_the_loop_allows_itself_the_watchdog_allows_too():
    assert silence_s(0.002, 8) == pytest.approx(0.04)
    assert silence_s(0.002, 8) > (8 + 1) * 0.002


def test_without_a_watchdog_nothing_happens():
    NOBODY_WATCHES.begin()
    NOBODY_WATCHES.beat()
    NOBODY_WATCHES.rest()
    assert not NOBODY_WATCHES.has_been_taken_for_dead
