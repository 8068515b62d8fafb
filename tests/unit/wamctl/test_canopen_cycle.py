"""The cycle against a bus of which every frame is scripted."""

import random
import struct
from collections import deque

import can
import numpy as np
import pytest

from wamctl.arm.config import BusSection, load_arm_file
from wamctl.canopen.cycle import Cycle
from wamctl.canopen.ds402 import Goal
from wamctl.drives.bus import Channel
from wamctl.errors import BusStopError

DRIVES = load_arm_file("wam7.yaml").drives
CHANNEL = Channel("virtual", "0")
NAMES = tuple(f"drive {k}" for k in range(1, 8))
ENABLED, DISABLED, FAULT = 0x1237, 0x0250, 0x0218
TURN = 2 * np.pi / 4096


def frame(can_id, data=b"", **kind):
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False, **kind)


def position(node, counts, word=DISABLED):
    return frame(0x180 + node, struct.pack("<Hi", word, counts))


class ScriptedBus:
    """Answers each SYNC with the frames that are due."""

    def __init__(self):
        self.queue = deque()
        self.answers = deque()
        self.sent = []

    def send(self, message):
        self.sent.append((message.arbitration_id, bytes(message.data)))
        if message.arbitration_id == 0x080 and self.answers:
            self.queue.extend(self.answers.popleft())

    def recv(self, timeout):
        return self.queue.popleft() if self.queue else None


@pytest.fixture
def bus():
    return ScriptedBus()


@pytest.fixture
def cycle(bus):
    found = Cycle(bus, DRIVES, NAMES, CHANNEL, BusSection(channel="test:0"))
    found.start()
    return found


class Now:
    """A cycle that waits for nothing, on a bus that stamps frames from its SYNC on."""

    def remaining(self):
        return 0.0

    def age(self, stamp_s):
        return stamp_s


def sample(cycle):
    return cycle.sample(Now())


def everyone(counts=0, word=DISABLED):
    return [position(node, counts, word) for node in range(1, 8)]


def test_positions_are_angles_of_the_motors(bus, cycle):
    bus.answers.append([position(node, 100 * node) for node in range(1, 8)])
    readings = sample(cycle)
    assert readings.angle_motor == pytest.approx(100 * np.arange(1, 8) * TURN)
    assert (readings.missing, readings.disabled, readings.fault) == ((), True, None)
    assert (readings.late, readings.duplicates, readings.out_of_order) == ((), (), ())


def test_a_position_that_stays_away_is_missing(bus, cycle):
    bus.answers.append([f for f in everyone() if f.arbitration_id != 0x183])
    readings = sample(cycle)
    assert readings.missing == (2,)
    assert np.isnan(readings.angle_motor[2])
    assert cycle.counters.lost_by_drive["drive 3"] == cycle.counters.lost == 1


def test_a_late_position_never_passes_for_a_new_one(bus, cycle):
    bus.answers.extend([everyone(1)[:6], everyone(2)])
    sample(cycle)
    bus.queue.append(position(7, 1))  # came after its cycle, before the next SYNC
    readings = sample(cycle)
    assert readings.angle_motor == pytest.approx(2 * TURN * np.ones(7))
    assert cycle.counters.late == 1


def test_after_a_gap_the_last_position_counts(bus, cycle):
    bus.answers.extend([[], everyone(1) + everyone(2)])  # the old ones came after the new SYNC
    assert sample(cycle).missing == tuple(range(7))
    readings = sample(cycle)
    assert readings.angle_motor == pytest.approx(2 * TURN * np.ones(7))
    assert readings.duplicates == tuple(range(7))
    assert cycle.counters.doubled == 7


def test_a_position_stamped_before_the_sync_is_an_older_one(bus, cycle):
    old = position(3, 1)
    old.timestamp = -0.001
    bus.answers.append([old, *[f for f in everyone(2) if f.arbitration_id != 0x183]])
    readings = sample(cycle)
    assert (readings.missing, readings.late) == ((2,), (2,))
    assert np.isnan(readings.angle_motor[2])
    assert (cycle.counters.late, cycle.counters.lost) == (1, 1)


@pytest.mark.parametrize(("age_ms", "late"), [(1.5, ()), (1.7, (2,))])
def test_a_position_behind_the_window_is_used_and_counted_as_late(bus, cycle, age_ms, late):
    answers = everyone(2)
    answers[2].timestamp = age_ms * 1e-3
    bus.answers.append(answers)
    readings = sample(cycle)
    assert (readings.missing, readings.late) == ((), late)
    assert readings.angle_motor == pytest.approx(2 * TURN * np.ones(7))


def test_a_position_behind_those_that_follow_it_is_told(bus, cycle):
    answers = everyone()
    bus.answers.append([*answers[:2], answers[3], answers[2], *answers[4:]])
    readings = sample(cycle)
    assert (readings.missing, readings.out_of_order) == ((), (2,))
    assert cycle.counters.reordered == 1


@pytest.mark.parametrize(
    "bad",
    [
        frame(0x183, b"\0" * 5),
        frame(0x183, b"\0" * 7),
        frame(0x183, b""),
        can.Message(arbitration_id=0x183, data=bytes(6), is_extended_id=True),
        frame(0x183, is_remote_frame=True),
    ],
)
def test_a_malformed_position_is_counted_and_not_used(bus, cycle, bad):
    bus.answers.append([*everyone(5)[:2], bad, *everyone(5)[3:]])
    assert sample(cycle).missing == (2,)
    assert cycle.counters.malformed == 1


def test_frames_of_strangers_are_counted(bus, cycle):
    bus.answers.append([frame(0x7FF, b"\1"), frame(0x185 + 0x20, b"\1" * 8), *everyone()])
    assert sample(cycle).missing == ()
    assert cycle.counters.foreign == 2


OWN = [frame(0x000, b"\1\0"), frame(0x080), frame(0x200, bytes(8)), frame(0x301, bytes(3))]
OWN += [frame(0x603, bytes(8)), frame(0x77F, b"\5")]


def test_a_frame_of_ours_that_another_program_here_sent_is_a_stop(bus, cycle):
    """SocketCAN does not give our own frames back: a local one is another program's."""
    bus.answers.append([frame(OWN[0].arbitration_id, OWN[0].data, is_rx=False), *everyone()])
    with pytest.raises(BusStopError):
        sample(cycle)


def test_where_an_interface_may_echo_our_frames_tell_nothing(bus):
    echoing = Cycle(bus, DRIVES, NAMES, Channel("slcan", "0"), BusSection(channel="slcan:0"))
    echoing.start()
    bus.answers.append([*OWN, *everyone()])
    sample(echoing)
    assert echoing.counters.foreign == 0


@pytest.mark.parametrize("own", OWN, ids=lambda f: f"{f.arbitration_id:#05x}")
def test_our_own_frames_from_elsewhere_are_a_stop(bus, cycle, own):
    bus.answers.append([own, *everyone()])
    with pytest.raises(BusStopError) as stop:
        sample(cycle)
    assert stop.value.cause == (
        f"another program commands the drives on bus virtual:0: it sent frame "
        f"{own.arbitration_id:#05x}"
    )


def test_a_flood_does_not_hold_the_cycle_for_ever(bus, cycle):
    bus.queue.extend(frame(0x7FF, b"\1") for _ in range(10_000))
    bus.answers.append(everyone())
    sample(cycle)
    assert len(bus.queue) > 9_000


def test_the_drives_are_led_to_enabled_one_command_at_a_time(bus, cycle):
    cycle.go(Goal.ENABLED)
    for word in (0x0250, 0x0231, 0x0233, ENABLED):
        bus.answers.append(everyone(word=word))
        readings = sample(cycle)
        cycle.send(np.zeros(7))
    commands = [data[0] for can_id, data in bus.sent if can_id == 0x305]
    assert commands == [0x06, 0x07, 0x0F]
    assert readings.enabled


def test_a_command_that_was_lost_is_sent_again(bus, cycle):
    cycle.go(Goal.ENABLED)
    for _ in range(25):
        bus.answers.append(everyone(word=0x0250))
        sample(cycle)
        cycle.send(np.zeros(7))
    commands = [data[0] for can_id, data in bus.sent if can_id == 0x305]
    assert commands == [0x06, 0x06, 0x06]


@pytest.mark.parametrize(("word", "shown"), [(FAULT, "FAULT"), (0x21F, "FAULT REACTION ACTIVE")])
def test_a_drive_in_fault_is_told(bus, cycle, word, shown):
    bus.answers.append([*everyone()[:6], position(7, 0, word)])
    assert sample(cycle).fault == f"drive 7 shows {shown} (statusword 0x{word:04X})"


def test_a_drive_that_leaves_operation_enabled_is_told(bus, cycle):
    cycle.go(Goal.ENABLED)
    bus.answers.extend([everyone(word=ENABLED), [*everyone(word=ENABLED)[:6], position(7, 0)]])
    assert sample(cycle).fault is None
    assert sample(cycle).fault == "drive 7 shows SWITCH ON DISABLED (statusword 0x0250)"


def test_torques_are_rounded_to_per_mille_of_rated_torque(bus, cycle):
    wanted = np.array([1.0, -1.0, 0.0004, 0.5, 0.1, -0.1, 0.05])
    sent = cycle.send(wanted)
    rated = np.array(DRIVES.rated_torque_nm)
    assert np.abs(sent - wanted).max() <= rated.max() / 2000
    first, second = (
        struct.unpack("<4h", data) for can_id, data in bus.sent if can_id in (0x200, 0x300)
    )
    permille = np.array([*first, *second[:3]])
    assert sent == pytest.approx(permille * rated / 1000)


def test_a_heartbeat_goes_out_ten_times_a_second(bus, cycle):
    for _ in range(500):
        bus.answers.append(everyone())
        sample(cycle)
    assert sum(can_id == 0x77F for can_id, _ in bus.sent) == 10


def test_a_bus_that_fails_is_one_sentence(bus, cycle):
    def fail(message):
        raise can.CanOperationError("Network is down")

    bus.send = fail
    with pytest.raises(BusStopError) as stop:
        sample(cycle)
    assert stop.value.cause == "bus virtual:0 failed (Network is down)"
    assert not stop.value.brakes


def test_bus_off_is_told(bus, cycle):
    bus.answers.append([can.Message(arbitration_id=0x40, data=bytes(8), is_error_frame=True)])
    with pytest.raises(BusStopError) as stop:
        sample(cycle)
    assert stop.value.cause == "bus virtual:0 went bus-off"


def test_silence_leaves_nothing_but_zero_torque(cycle):
    frames = {(m.arbitration_id, bytes(m.data)) for m in cycle.zero_torque_frames()}
    assert frames == {
        (0x200, bytes(8)),
        (0x300, bytes(8)),
        *((twin, bytes(8)) for twin in (0x400, 0x500)),
        (0x080, b""),
        *((0x300 + node, b"\0\0\x0a") for node in range(1, 8)),
    }


def test_a_hundred_thousand_fuzzed_frames_do_no_harm(bus, cycle):
    chance = random.Random(5)
    valid = [*everyone(), frame(0x701, b"\5"), frame(0x081, bytes(8)), frame(0x281, bytes(4))]
    total = 0
    while total < 100_000:
        batch = [f for f in (fuzzed(chance, valid) for _ in range(50)) if not cycle.is_own(f)]
        total += len(batch)
        bus.answers.append(batch + everyone(7))
        readings = sample(cycle)
        assert len(readings.angle_motor) == 7
        bus.queue.clear()
        cycle.send(np.zeros(7))
    counters = cycle.counters
    assert counters.malformed > 1000
    assert counters.foreign > 1000
    torques = {data for can_id, data in bus.sent if can_id in (0x200, 0x300)}
    assert torques == {bytes(8)}


def fuzzed(chance, valid):
    """A random frame, or a valid one with some of its bits or its length changed."""
    if chance.random() < 0.5:
        return can.Message(
            arbitration_id=chance.randrange(0x800),
            data=chance.randbytes(chance.randrange(9)),
            is_extended_id=chance.random() < 0.1,
            is_remote_frame=False,
        )
    kind = chance.choice(valid)
    data = bytearray(kind.data)
    for _ in range(chance.randrange(4)):
        if data:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    data = data[: chance.randrange(len(data) + 1)] if chance.random() < 0.3 else data
    return frame(kind.arbitration_id ^ (chance.random() < 0.1) << chance.randrange(11), bytes(data))
