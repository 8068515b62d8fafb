"""What is heard of the drives outside the cycle: emergencies, heartbeats, inputs."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wamctl.arm.config import StopInputSection, load_arm_file
from wamctl.canopen.emcy import emergency, meaning
from wamctl.canopen.inputs import StopInput, Temperatures
from wamctl.canopen.supervision import Supervision

NAMES = ("drive 1 (node 4)", "drive 2 (node 9)")
DRIVES = load_arm_file("wam7.yaml").drives


@pytest.fixture
def watch():
    watch = Supervision((4, 9), NAMES, 0.1)
    watch.start(0.0)
    return watch


def test_an_emergency_is_told_with_its_meaning(watch):
    assert watch.hear(0x089, struct.pack("<HB5s", 0x3220, 5, b""), 0.5)
    assert watch.fault(0.2) == "drive 2 (node 9) reported EMCY 0x3220, bus under-voltage"


def test_the_first_fault_stays(watch):
    watch.hear(0x089, struct.pack("<HB5s", 0x3220, 5, b""), 0.1)
    watch.hear(0x084, struct.pack("<HB5s", 0x2310, 3, b""), 0.1)
    assert watch.fault(0.2) == "drive 2 (node 9) reported EMCY 0x3220, bus under-voltage"
    watch.start(1.0)
    assert watch.fault(1.0) is None


def test_the_end_of_an_error_is_no_fault(watch):
    assert watch.hear(0x089, bytes(8), 0.1)
    assert watch.fault(0.1) is None


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x2310, "over-current, i2t limit"),
        (0x8700, "SYNC lost"),
        (0x0000, "no error"),
        (0x2399, "current (unlisted code)"),
        (0xB000, "unknown (unlisted code)"),
    ],
)
def test_codes_in_words(code, words):
    assert meaning(code) == words


@pytest.mark.parametrize("length", [0, 2, 7])
def test_a_short_emergency_is_none(watch, length):
    assert emergency(bytes(length)) is None
    assert not watch.hear(0x084, bytes(length), 0.0)


def test_a_silent_drive_is_missed_after_three_heartbeats(watch):
    for tenth in range(1, 6):
        watch.hear(0x704, b"\x05", tenth / 10)
    assert watch.fault(0.3) is None
    assert watch.fault(0.31) == ("drive 2 (node 9) sent no heartbeat for 0.310 s (limit 0.300 s)")


def test_leaving_operational_is_a_fault(watch):
    watch.hear(0x704, b"\x05", 0.1)
    watch.hear(0x704, b"\x7f", 0.2)
    assert watch.fault(0.2) == "drive 1 (node 4) left OPERATIONAL for NMT state PRE-OPERATIONAL"


def test_a_heartbeat_from_before_the_start_is_none(watch):
    assert watch.hear(0x704, b"\x7f", 0.0)
    assert watch.fault(0.0) is None


def test_a_restart_is_a_fault(watch):
    watch.hear(0x709, b"\x00", 0.0)
    assert watch.fault(0.0) == "drive 2 (node 9) started anew (boot-up message)"


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_frames_of_others_are_not_heard(can_id, data):
    watch = Supervision((4, 9), NAMES, 0.1)
    heard = watch.hear(can_id, data, 0.0)
    assert not heard or can_id in (0x084, 0x089, 0x704, 0x709)


def temperatures(**changes):
    return Temperatures(DRIVES.model_copy(update=changes), tuple("1234567"))


def stop_input(**changes):
    switch = StopInputSection(node_id=2, bit=2, **changes)
    return StopInput(DRIVES.model_copy(update={"stop_input": switch}))


def test_a_hot_motor_stops_the_arm():
    heard = temperatures()
    assert heard.hear(0x283, struct.pack("<hh", 450, 600))
    assert heard.reason() is None
    assert heard.hear(0x283, struct.pack("<hh", 450, 601))
    assert heard.reason() == "motor of 3 has 60.1 deg C, above its limit of 60.0 deg C"


def test_without_a_limit_temperatures_are_nothing():
    assert not temperatures(temperature_limit_c=None).hear(0x283, struct.pack("<hh", 999, 999))


@pytest.mark.parametrize(("level", "pressed"), [(0, 0b0000), (1, 0b0100)])
def test_the_stop_switch_stops_the_arm(level, pressed):
    heard = stop_input(stops_at=level)
    heard.hear(0x382, struct.pack("<I", pressed ^ 0b0100))
    assert heard.reason() is None
    heard.hear(0x382, struct.pack("<I", pressed))
    assert heard.reason() == "the stop switch was pressed"


def test_a_stop_switch_that_is_not_heard_of_stops_the_arm():
    heard = stop_input()
    reasons = [heard.reason() for _ in range(6)]
    assert reasons == [None] * 5 + ["the stop switch was not heard of for 6 cycles"]
