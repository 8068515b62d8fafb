"""Questions to one Puck, whose answers to earlier ones may still be on their way."""

import uuid
from collections.abc import Iterator

import can
import pytest

from wamctl.errors import BusError
from wamctl.puck.exchange import ATTEMPTS, Exchange
from wamctl.puck.wiring import property_reply

NODE = 10
ZERO = 21


@pytest.fixture
def ends() -> Iterator[tuple[can.BusABC, can.BusABC]]:
    """The driver's end of a bus, and the Puck's."""
    channel = uuid.uuid4().hex
    with can.Bus(channel, "virtual") as own, can.Bus(channel, "virtual") as puck:
        yield own, puck


def answers(puck: can.BusABC, *values: int) -> None:
    for value in values:
        data = bytes([0x80 | ZERO, 0]) + value.to_bytes(4, "little")
        identifier = property_reply(NODE)
        puck.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))


def test_a_late_answer_does_not_tell_what_was_set(ends):
    own, puck = ends
    answers(puck, 0, 0, 1)
    Exchange(own).establish(NODE, {"ZERO": ZERO}, {"ZERO": 1})
    told = puck.recv(0)
    assert told is not None
    assert told.data[:3] == bytes([0x80 | ZERO, 0, 1])


def test_what_does_not_stick_is_told(ends):
    own, puck = ends
    answers(puck, *[0] * ATTEMPTS)
    with pytest.raises(BusError, match="says ZERO = 0 after it was set to 1"):
        Exchange(own).establish(NODE, {"ZERO": ZERO}, {"ZERO": 1})


def test_a_setting_that_came_too_soon_is_sent_again(ends):
    """A safety module drops what comes within 10 ms of another; a busy bus brings them closer."""
    own, puck = ends
    answers(puck, *[0] * ATTEMPTS, 1)
    Exchange(own).establish(NODE, {"ZERO": ZERO}, {"ZERO": 1}, gap_s=0.001)
    told = [frame for frame in iter(lambda: puck.recv(0), None) if frame.data[0] & 0x80]
    assert [frame.data[2] for frame in told] == [1, 1]
