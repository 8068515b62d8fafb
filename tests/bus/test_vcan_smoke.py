"""The kernel's own CAN: what every other bus test on vcan takes for granted."""

import subprocess
import sys
import time

import can
import pytest

pytestmark = pytest.mark.vcan

ECHO = """
import can
with can.Bus(interface="socketcan", channel="vcan0") as bus:
    bus.send(can.Message(arbitration_id=0x701, data=[0], is_extended_id=False))
    for _ in range(5):
        heard = bus.recv(10)
        answer = can.Message(
            arbitration_id=heard.arbitration_id + 0x80, data=heard.data, is_extended_id=False
        )
        bus.send(answer)
"""


def frame(identifier: int, data: list[int], **options: bool) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False, **options)


def received(bus: can.BusABC) -> can.Message:
    message = bus.recv(10)
    assert message is not None
    return message


def test_two_processes_share_a_bus() -> None:
    with (
        can.Bus(interface="socketcan", channel="vcan0") as bus,
        subprocess.Popen([sys.executable, "-c", ECHO]) as peer,
    ):
        assert received(bus).arbitration_id == 0x701
        for k in range(5):
            bus.send(frame(0x180 + k, [k] * 8))
            answer = received(bus)
            assert answer.arbitration_id == 0x200 + k
            assert bytes(answer.data) == bytes([k] * 8)
            assert abs(time.time() - answer.timestamp) < 10
        assert peer.wait(10) == 0


def test_the_kernel_sends_periodically() -> None:
    with (
        can.Bus(interface="socketcan", channel="vcan1") as one,
        can.Bus(interface="socketcan", channel="vcan1") as other,
    ):
        task = one.send_periodic(frame(0x80, []), 0.02)
        stamps = [received(other).timestamp for _ in range(11)]
        task.stop()
    assert stamps == sorted(stamps)
    assert stamps[-1] - stamps[0] > 0.1


def test_long_frames_pass() -> None:
    with (
        can.Bus(interface="socketcan", channel="vcan0", fd=True) as one,
        can.Bus(interface="socketcan", channel="vcan0", fd=True) as other,
    ):
        one.send(frame(0x200, list(range(64)), is_fd=True, bitrate_switch=True))
        message = received(other)
    assert bytes(message.data) == bytes(range(64))
    assert message.is_fd
    assert message.bitrate_switch
