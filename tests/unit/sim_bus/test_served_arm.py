"""The served arm on its two clocks, seen by a python-can client."""

import threading
import time

import can
import numpy as np
import pytest

from sim_bus.assembly import load_simulation
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.hub import Received
from sim_bus.can_bus.python_can_hub import PythonCanHub
from sim_bus.can_bus.socket_hub import SocketHub
from sim_bus.errors import SimulatedBusError
from sim_bus.server import RealTime

pytestmark = pytest.mark.alone


def positions(serving, master, path, torques, seed=0):
    with serving(SocketHub(path), lockstep=True, seed=seed):
        with can.Bus(interface="simbus", channel=str(path)) as bus:
            arm = master(bus)
            arm.enable()
            return [arm.cycle(permille) for permille in torques]


def test_lockstep_is_the_same_every_time_and_depends_on_the_seed(serving, master, tmp_path):
    torques = [[round(100 * np.sin(0.02 * k))] * 7 for k in range(40)]
    first, again = (positions(serving, master, tmp_path / n, torques) for n in ("a", "b"))
    other = positions(serving, master, tmp_path / "c", torques, seed=1)
    assert first == again
    assert first != other
    assert first[0] != first[-1]


def test_a_torque_sent_after_one_sync_acts_from_the_next_one_on(serving, master, tmp_path):
    nothing, push = [0] * 7, [0] * 6 + [1000]
    limp = positions(serving, master, tmp_path / "a", [nothing] * 6)
    pushed = positions(serving, master, tmp_path / "b", [nothing] * 2 + [push] * 4)
    assert limp[:4] == pushed[:4]  # sent in cycle 2, in force from 3 to 4
    assert limp[4][6] != pushed[4][6]


def test_the_stand_holds_the_arm_until_all_drives_are_enabled(lockstep_bus, master):
    with can.Bus(interface="simbus", channel=lockstep_bus) as bus:
        arm = master(bus)
        for _ in range(100):
            arm.send(0x080)
        arm.enable()
        start = arm.cycle([0] * 7)
        held = np.array([28.25 * -1.0, -28.25 * -1.0, -18.0 * 2.5]) * 4096 / (2 * np.pi)
        assert np.abs(start[1:4] - held).max() < 2
        for _ in range(100):
            fallen = arm.cycle([0] * 7)
    assert abs(fallen[1] - start[1]) > 100


def test_watchdogs_count_virtual_time_in_lockstep(lockstep_bus, master):
    with can.Bus(interface="simbus", channel=lockstep_bus) as bus:
        arm = master(bus)
        arm.write(1, 0x1017, 0, 20, 2)
        for node in range(2, 8):
            arm.write(node, 0x1017, 0, 0, 2)
        arm.send(0, b"\x01\x00")
        time.sleep(0.1)
        for _ in range(25):
            arm.send(0x080)
        heartbeats = 0
        while (message := bus.recv(0.5)) is not None:
            heartbeats += message.arbitration_id == 0x701
    assert heartbeats == 2  # 25 cycles of 2 ms


def test_positions_arrive_in_real_time_no_sooner_than_their_last_bit(real_time_bus, master):
    with can.Bus(interface="simbus", channel=real_time_bus) as bus:
        arm = master(bus)
        arm.enable()
        fastest = 1.0
        for _ in range(20):
            began = time.perf_counter()
            arm.cycle([0] * 7)
            fastest = min(fastest, time.perf_counter() - began)
    assert fastest > 7e-6 * 95  # seven frames of at least 95 bits at 1 Mbit/s


def test_programs_hear_each_other_and_not_themselves(lockstep_bus):
    with (
        can.Bus(interface="simbus", channel=lockstep_bus) as one,
        can.Bus(interface="simbus", channel=lockstep_bus) as two,
    ):
        time.sleep(0.2)
        one.send(can.Message(arbitration_id=0x123, data=b"\x01\x02", is_extended_id=False))
        heard = two.recv(5.0)
        assert heard is not None
        assert (heard.arbitration_id, bytes(heard.data)) == (0x123, b"\x01\x02")
        assert one.recv(0.2) is None


def test_a_notifier_and_a_filter_work_on_the_simulated_bus(lockstep_bus):
    only = [{"can_id": 0x583, "can_mask": 0x7FF}]
    with can.Bus(interface="simbus", channel=lockstep_bus, can_filters=only) as bus:
        reader = can.BufferedReader()
        notifier = can.Notifier(bus, [reader])
        for node in (3, 4):
            request = bytes([0x40, 0, 0x10, 0, 0, 0, 0, 0])
            bus.send(can.Message(arbitration_id=0x600 + node, data=request, is_extended_id=False))
        first, second = reader.get_message(5.0), reader.get_message(0.3)
        notifier.stop()
    assert first is not None
    assert first.arbitration_id == 0x583
    assert second is None


def test_a_closed_server_is_an_error_of_the_bus(serving, tmp_path):
    with serving(SocketHub(tmp_path / "bus"), lockstep=True):
        bus = can.Bus(interface="simbus", channel=str(tmp_path / "bus"))
        while bus.recv(0.2) is not None:
            pass
    with bus, pytest.raises(can.CanOperationError) as caught:
        bus.recv(5.0)
    assert str(caught.value) == f"simulated bus {tmp_path}/bus was closed by its server"


def test_extended_remote_and_long_frames_pass(lockstep_bus):
    with (
        can.Bus(interface="simbus", channel=lockstep_bus, fd=True) as one,
        can.Bus(interface="simbus", channel=lockstep_bus, fd=True) as two,
    ):
        time.sleep(0.2)
        sent = [
            can.Message(arbitration_id=0x1ABCDEF0, data=b"\x07", is_extended_id=True),
            can.Message(arbitration_id=0x321, is_remote_frame=True, is_extended_id=False),
            can.Message(
                arbitration_id=0x322, data=bytes(range(48)), is_fd=True, is_extended_id=False
            ),
        ]
        for message in sent:
            one.send(message)
            heard = two.recv(5.0)
            assert heard is not None
            for field in ("arbitration_id", "is_extended_id", "is_remote_frame", "is_fd", "data"):
                assert getattr(heard, field) == getattr(message, field)


def test_the_arm_is_served_on_a_multicast_bus(serving, master):
    channel = "239.74.163.77"
    try:
        hub = PythonCanHub("udp_multicast", channel)
    except SimulatedBusError as error:
        pytest.skip(f"no multicast on this machine ({error})")
    with serving(hub, lockstep=True):
        with can.Bus(interface="udp_multicast", channel=channel, hop_limit=0) as bus:
            bus.send(
                can.Message(
                    arbitration_id=0x603,
                    data=bytes([0x40, 0, 0x10, 0, 0, 0, 0, 0]),
                    is_extended_id=False,
                )
            )
            answers = [m for _ in range(20) if (m := bus.recv(0.2)) is not None]
    assert [m.arbitration_id for m in answers].count(0x583) == 1


class LoneHub:
    """A hub that nobody has joined."""

    def __init__(self, gathers=False):
        self.gathers = gathers
        self.frames = []
        self.flushed = []

    def deliver(self, frames, sender, time_ns):
        self.frames += frames

    def flush(self):
        self.flushed += self.frames[len(self.flushed) :]


def test_a_simulation_that_was_stopped_does_not_rush_after_the_clock():
    simulation = load_simulation("wam7.yaml", 0)
    hub = LoneHub()
    service = RealTime(simulation.arm, hub, simulation.timing)
    service.start()
    began = time.monotonic_ns()
    service.catch_up(began + 100_000_000)
    booted = len(hub.frames)
    service.catch_up(began + 60_000_000_000)  # 29 heartbeats of each drive later
    assert booted == len(hub.frames) == 7
    service.catch_up(began + 60_010_000_000)
    assert simulation.arm.plant.time_ns < 200_000_000


@pytest.mark.parametrize(("gathers", "given_out"), [(False, [4, 7]), (True, [0, 7])])
def test_frames_without_a_pause_are_given_out_together_where_calls_are_dear(gathers, given_out):
    simulation = load_simulation("wam7.yaml", 0)
    hub = LoneHub(gathers)
    service = RealTime(simulation.arm, hub, simulation.timing)
    service.start()
    began = service._origin_ns
    flushed = []
    for after_ns in (250_000, 600_000):  # a boot-up frame takes some 60 us
        service.catch_up(began + after_ns)
        flushed.append(len(hub.flushed))
    assert flushed == given_out


def test_a_frame_acts_when_it_was_sent_even_if_it_is_read_later():
    simulation = load_simulation("wam7.yaml", 0)
    hub = LoneHub()
    service = RealTime(simulation.arm, hub, simulation.timing)
    service.start()
    began = time.monotonic_ns()
    request = Frame(0x601, b"\x40\x00\x10\x00\0\0\0\0")
    service.catch_up(began + 1_000_000)
    time.sleep(0.01)
    service.take(Received(request, None, began + 1_000_000))
    service.catch_up(began + 1_100_000)
    assert [f.can_id for f in hub.frames if f.can_id < 0x700] == []
    service.catch_up(began + 1_500_000)
    assert [f.can_id for f in hub.frames if f.can_id < 0x700] == [0x601, 0x581]


@pytest.mark.parametrize(("lockstep", "hears"), [(True, [0x181, 0x182]), (False, [])])
def test_in_lockstep_no_time_passes_until_the_arm_has_answered(tmp_path, lockstep, hears):
    hub = SocketHub(tmp_path / "bus")
    with can.Bus(interface="simbus", channel=str(tmp_path / "bus"), lockstep=lockstep) as bus:
        hub.receive(hub.sources())
        bus.send(can.Message(arbitration_id=0x080, is_extended_id=False))
        (sync,) = hub.receive(hub.sources()[1:])

        may_answer = threading.Event()

        def answer():
            may_answer.wait(60.0)
            hub.deliver([Frame(0x181)], None, 0)
            hub.flush()
            time.sleep(0.2)
            hub.deliver([Frame(0x182)], None, 0)
            hub.settle(sync.sender, 0)
            hub.flush()

        thread = threading.Thread(target=answer)
        thread.start()
        if lockstep:  # the answer comes long after the limit of 1 ms
            threading.Timer(0.2, may_answer.set).start()
        heard = [message.arbitration_id for message in iter(lambda: bus.recv(0.001), None)]
        may_answer.set()
        thread.join()
        assert heard == hears
    hub.close()
