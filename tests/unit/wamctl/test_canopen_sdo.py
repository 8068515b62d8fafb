"""Questions about a drive's objects where answers come late, twice, or to another question."""

import struct

import can
import pytest

from wamctl.arm.config import find_file
from wamctl.canopen import dictionary as od
from wamctl.canopen import sdo
from wamctl.drives import bus as buses
from wamctl.drives.bus import parse_channel
from wamctl.drives.one_master import check_silence
from wamctl.errors import BusError, SilentDriveError

NODE = 3


class Bus:
    """A drive that answers each question, and time that passes only while nothing comes."""

    def __init__(self, values=(), held_up=0):
        self.values, self.held_up = dict(values), held_up
        self.queue, self.now_s = [], 0.0

    def recv(self, timeout):
        if timeout > 0.0 and self.held_up:  # the program stands still meanwhile
            self.held_up -= 1
            self.now_s += 1.0
            return None
        if not self.queue:
            self.now_s += timeout
            return None
        return self.queue.pop(0)

    def send(self, message):
        command, index, subindex, value = struct.unpack("<BHBI", message.data)
        kind = 0x43 if command == 0x40 else 0x60
        if command != 0x40:
            self.values[index] = value
        value = self.values.get(index)
        if value is not None:
            self.answer(kind, index, subindex, value if kind == 0x43 else 0)

    def answer(self, command, index, subindex, value):
        data = struct.pack("<BHBI", command, index, subindex, value)
        self.queue.append(message(0x580 + NODE, data))


def message(can_id, data=b""):
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False)


@pytest.fixture
def drive(monkeypatch):
    dictionary = od.load_dictionary(find_file("puck4.eds"), NODE)

    def made(**settings):
        bus = Bus(**settings)
        monkeypatch.setattr(buses.time, "monotonic", lambda: bus.now_s)
        return sdo.Node(bus, NODE, dictionary)

    return made


def test_an_answer_that_has_arrived_while_this_program_stood_still_counts(drive):
    node = drive(values={0x6064: 1234}, held_up=1)
    assert sdo.read(node, od.POSITION) == 1234
    assert node.bus.now_s == 1.0
    assert not node.bus.queue


@pytest.mark.parametrize("held_up", [0, 1, 2])
def test_second_answers_to_a_repeated_question_are_passed_over(drive, held_up):
    node = drive(values={0x6064: 7})
    late = node.bus.send
    kept = []

    def send(frame):
        late(frame)
        if len(kept) < held_up:  # on its way until the question has been repeated
            kept.append(node.bus.queue.pop())
        elif kept:
            node.bus.queue += kept
            kept[:] = []
            node.bus.send = late

    node.bus.send = send
    sdo.write(node, od.MAX_TORQUE, 700)
    assert sdo.read(node, od.POSITION) == 7


def test_answers_from_before_the_question_are_left_out(drive):
    node = drive(values={0x6064: 2})
    node.bus.answer(0x43, 0x6064, 0, 1)
    assert sdo.read(node, od.POSITION) == 2


def test_a_refused_question_says_why(drive):
    node = drive()
    node.bus.send = lambda frame: node.bus.answer(0x80, 0x6064, 0, 0x06020000)
    with pytest.raises(BusError, match=r"object 0x6064:0 was refused .*Object does not exist"):
        sdo.read(node, od.POSITION)


def test_a_silent_drive_is_asked_three_times(drive):
    node = drive()
    with pytest.raises(SilentDriveError, match=r"no answer about object 0x6064:0 within 0.3 s, 3"):
        sdo.read(node, od.POSITION)
    assert node.bus.now_s == pytest.approx(0.9)


def test_too_few_bytes_are_no_value(drive):
    node = drive()
    node.bus.send = lambda frame: node.bus.answer(0x4B, 0x6064, 0, 1)
    with pytest.raises(BusError, match="object 0x6064:0 came with 2 bytes instead of 4"):
        sdo.read(node, od.POSITION)


def test_another_master_is_heard_though_this_program_stood_still(drive):
    bus = drive(held_up=1).bus
    bus.queue.append(message(0x80))
    with pytest.raises(BusError, match="Another program commands the drives"):
        check_silence(bus, parse_channel("virtual:x"), lambda frame: frame.arbitration_id == 0x80)
