"""Bursts of frames on the kernel's CAN, on either side of the wire."""

import errno
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

import can
import pytest

from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.hubs import open_hub
from sim_bus.errors import SimulatedBusError
from wamctl.arm.config import BusSection
from wamctl.drives.bus import open_bus, parse_channel, send_all
from wamctl.drives.socketcan import BurstBus

pytestmark = pytest.mark.vcan

CYCLE = [0x404, 0x423, 0x443, 0x463, 0x483, 0x4A3, 0x4C3, 0x4E3, 0x401, 0x402]


def frame(can_id: int, data: bytes = b"", **kind: bool) -> can.Message:
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False, **kind)


@contextmanager
def down(name: str) -> Iterator[None]:
    """An interface that is down while the block runs."""
    subprocess.run(["ip", "link", "set", name, "down"], check=True)
    try:
        yield
    finally:
        subprocess.run(["ip", "link", "set", name, "up"], check=True)


def test_a_bus_of_the_kernel_takes_and_gives_bursts() -> None:
    channel = parse_channel("socketcan:vcan0")
    with (
        open_bus(channel, BusSection(channel="socketcan:vcan0")) as bus,
        can.Bus(interface="socketcan", channel="vcan0") as plain,
    ):
        assert isinstance(bus, BurstBus)
        send_all(bus, [frame(can_id, bytes([k])) for k, can_id in enumerate(CYCLE)])
        heard = [plain.recv(10.0) for _ in CYCLE]
        assert [m.arbitration_id for m in heard if m] == CYCLE
        before_s = time.time()
        for can_id in CYCLE:
            plain.send(frame(can_id, b"\x55"))
        after_s = time.time()
        answers = [bus.recv(10.0) for _ in CYCLE]
        assert [m.arbitration_id for m in answers if m] == CYCLE
        stamps = [m.timestamp for m in answers if m]
        assert stamps == sorted(stamps)
        assert before_s <= stamps[0]
        assert stamps[-1] <= after_s
        assert not any(m.is_rx for m in answers if m)  # they come from this machine
        assert bus.recv(0.0) is None


def test_long_frames_and_error_frames_pass() -> None:
    with (
        BurstBus("vcan0", fd=True) as bus,
        can.Bus(interface="socketcan", channel="vcan0", fd=True) as plain,
    ):
        plain.send(frame(0x200, bytes(range(64)), is_fd=True, bitrate_switch=True))
        plain.send(frame(0x040, bytes(8), is_error_frame=True))
        long, error = bus.recv(10.0), bus.recv(10.0)
        assert long is not None
        assert error is not None
        assert (bytes(long.data), long.is_fd, long.bitrate_switch) == (bytes(range(64)), True, True)
        assert (error.is_error_frame, error.arbitration_id) == (True, 0x040)
        bus.send_all([frame(0x201, bytes(12), is_fd=True), frame(0x202, b"\x01")])
        first, second = plain.recv(10.0), plain.recv(10.0)
        assert first is not None
        assert second is not None
        assert (len(first.data), first.is_fd, second.is_fd) == (12, True, False)


def test_a_filtered_bus_hears_what_it_asked_for() -> None:
    with (
        BurstBus("vcan0", can_filters=[{"can_id": 0x423, "can_mask": 0x7FF}]) as bus,
        can.Bus(interface="socketcan", channel="vcan0") as plain,
    ):
        for can_id in CYCLE:
            plain.send(frame(can_id))
        heard = bus.recv(10.0)
        assert heard is not None
        assert heard.arbitration_id == 0x423
        assert bus.recv(0.1) is None


def test_an_interface_that_goes_down_is_told() -> None:
    with BurstBus("vcan1") as bus:
        with down("vcan1"):
            with pytest.raises(can.CanOperationError, match="receive: Network is down"):
                bus.recv(10.0)
            with pytest.raises(can.CanOperationError, match="transmit: Network is down") as caught:
                bus.send_all([frame(0x080), frame(0x081)])
        assert caught.value.error_code == errno.ENETDOWN


def test_the_arm_hears_bursts_with_the_instant_of_each_frame() -> None:
    hub = open_hub("socketcan:vcan0", fd=False)
    with can.Bus(interface="socketcan", channel="vcan0") as plain:
        before_ns = time.monotonic_ns()
        for k in range(150):
            plain.send(frame(0x100 + k, bytes([k])))
        after_ns = time.monotonic_ns()
        heard = hub.receive(hub.sources())
    assert hub.receive([]) == hub.receive(hub.sources()) == []
    hub.close()
    assert [r.frame for r in heard] == [Frame(0x100 + k, bytes([k])) for k in range(150)]
    sent_ns = [r.sent_ns for r in heard if r.sent_ns is not None]
    assert sent_ns == sorted(sent_ns)
    assert before_ns - 1_000_000 <= sent_ns[0]  # two clocks are compared
    assert sent_ns[-1] <= after_ns + 1_000_000


@pytest.mark.parametrize("fd", [False, True])
def test_the_arm_answers_in_bursts(fd: bool) -> None:
    hub = open_hub("socketcan:vcan0", fd)
    sent = [Frame(0x180 + k, bytes([k] * (12 if fd else 6)), fd) for k in range(100)]
    with can.Bus(interface="socketcan", channel="vcan0", fd=fd) as plain:
        hub.deliver(sent[:70], None, 0)
        hub.deliver([Frame(0x7FF)], hub, 0)  # was on the bus already
        hub.deliver(sent[70:], None, 0)
        assert plain.recv(0.0) is None
        hub.flush()
        heard = [plain.recv(10.0) for _ in sent]
        assert plain.recv(0.0) is None
    hub.close()
    assert [Frame(m.arbitration_id, bytes(m.data), m.is_fd) for m in heard if m] == sent


def test_the_arm_tells_that_its_interface_went_down() -> None:
    hub = open_hub("socketcan:vcan1", fd=False)
    sentence = r"sim-bus lost the bus socketcan:vcan1 \(Network is down\)\."
    with down("vcan1"):
        with pytest.raises(SimulatedBusError, match=sentence):
            hub.receive(hub.sources())
        hub.deliver([Frame(0x181)], None, 0)
        with pytest.raises(SimulatedBusError, match=sentence):
            hub.flush()
    hub.close()


def test_no_such_interface() -> None:
    with pytest.raises(
        SimulatedBusError, match=r"cannot open the bus socketcan:vcan99 \(.*No such"
    ):
        open_hub("socketcan:vcan99", fd=False)
