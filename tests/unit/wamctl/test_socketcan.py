"""Bursts of frames through a pair of UDP sockets, which the kernel stamps as it stamps CAN's."""

import errno
import socket
import time

import can
import pytest
from can.interfaces.socketcan import socketcan

from wamctl.drives import socketcan as bursts
from wamctl.drives.bus import send_all
from wamctl.drives.socketcan import BurstBus

pytestmark = pytest.mark.alone


def frame(can_id, data=b"", **kind):
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False, **kind)


def shown(message):
    kind = (message.is_extended_id, message.is_error_frame, message.is_fd)
    return message.arbitration_id, bytes(message.data), kind


@pytest.fixture
def peer():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        yield found


@pytest.fixture
def bus(monkeypatch, peer):
    own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    own.bind(("127.0.0.1", 0))
    own.connect(peer.getsockname())
    peer.connect(own.getsockname())
    monkeypatch.setattr(socketcan, "create_socket", lambda: own)
    monkeypatch.setattr(socketcan, "bind_socket", lambda found, channel: None)
    with BurstBus("udp") as found:
        yield found


def put(peer, *messages):
    for message in messages:
        peer.send(socketcan.build_can_frame(message))


def wait_for_stamps(bus, peer):
    """The kernel begins to stamp a while after it is asked to: until then it says when it is read.

    (It switches the stamps on in the background, and fills in the time of reading meanwhile.)
    """
    for _ in range(500):
        put(peer, frame(0x7FF))
        time.sleep(0.01)
        reading_s = time.time()
        message = bus.recv(1.0)
        if message is not None and message.timestamp < reading_s:
            return
    pytest.fail("the kernel does not stamp frames when they arrive")


def test_frames_come_in_their_order_with_the_kernels_stamps(bus, peer):
    wait_for_stamps(bus, peer)
    wanted = [frame(0x400 + k, bytes(range(k % 9))) for k in range(150)]
    wanted[3] = can.Message(arbitration_id=0x1234567, data=b"\x01")
    wanted[4] = frame(0x040, bytes(8), is_error_frame=True)
    wanted[5] = frame(0x201, bytes(range(64)), is_fd=True, bitrate_switch=True)
    before_s = time.time()
    put(peer, *wanted)
    time.sleep(0.02)
    reading_s = time.time()
    heard = []
    while (message := bus.recv(0.0)) is not None:
        heard.append(message)
    assert [shown(m) for m in heard] == [shown(m) for m in wanted]
    assert heard[5].bitrate_switch
    stamps = [m.timestamp for m in heard]
    assert stamps == sorted(stamps)
    assert before_s <= stamps[0]
    assert stamps[-1] <= reading_s


def test_a_burst_is_one_call_of_the_system(bus, peer, monkeypatch):
    calls = []

    class Counted:
        def __getattr__(self, name):
            calls.append(name)
            return getattr(system, name)

    system = bursts._system
    monkeypatch.setattr(bursts, "_system", Counted())
    put(peer, *[frame(0x423 + 32 * k, bytes(3)) for k in range(7)])
    heard = [bus.recv(0.0) for _ in range(7)]
    send_all(bus, [frame(0x401, bytes(8)), frame(0x402, bytes(8))])
    assert None not in heard
    assert calls == ["recvmmsg", "sendmmsg"]


def test_more_than_a_burst_is_sent_in_its_order(bus, peer):
    bus.send_all([frame(0x100 + k, bytes([k])) for k in range(100)])
    heard = [socketcan.dissect_can_frame(peer.recv(72)) for _ in range(100)]
    assert [(can_id, data) for can_id, _, _, data in heard] == [
        (0x100 + k, bytes([k])) for k in range(100)
    ]


def test_nothing_comes_within_the_limit(bus):
    began_s = time.monotonic()
    assert bus.recv(0.05) is None
    assert time.monotonic() - began_s >= 0.05


def test_a_frame_ends_the_wait(bus, peer):
    put(peer, frame(0x123, b"\x07"))
    assert shown(bus.recv(60.0)) == (0x123, b"\x07", (False, False, False))
    put(peer, frame(0x124))
    assert bus.recv().arbitration_id == 0x124


@pytest.mark.parametrize(
    ("number", "sentence"),
    [
        (errno.ENOBUFS, "Failed to transmit: No buffer space available"),
        (errno.ENETDOWN, "Failed to transmit: Network is down"),
        (errno.EAGAIN, "Transmit buffer full"),
    ],
)
def test_what_follows_a_part_of_a_burst_is_told(bus, monkeypatch, number, sentence):
    """The kernel takes two of five frames, one more when asked to go on, and then says why."""
    asked = []

    class Full:
        answers = iter([2, 1, -1])

        def sendmmsg(self, descriptor, entries, count, flags):
            asked.append((count, flags))
            bursts.ctypes.set_errno(number)
            return next(self.answers)

    monkeypatch.setattr(bursts, "_system", Full())
    with pytest.raises(can.CanOperationError, match=sentence) as caught:
        bus.send_all([frame(0x100 + k) for k in range(5)])
    assert caught.value.error_code == number
    assert asked == [(count, socket.MSG_DONTWAIT) for count in (5, 3, 2)]


def test_a_lost_interface_is_told(bus, peer):
    peer.close()
    bus.send(frame(0x080))  # the answer is that nobody is there
    with pytest.raises(can.CanOperationError, match="Failed to receive: Connection refused"):
        bus.recv(5.0)


def test_a_frame_without_a_stamp_is_refused(bus, peer):
    bus.socket.setsockopt(socket.SOL_SOCKET, 35, 0)  # SO_TIMESTAMPNS
    put(peer, frame(0x080))
    with pytest.raises(can.CanOperationError, match="the kernel has not stamped a frame"):
        bus.recv(5.0)
