"""What the Pucks are asked, and what follows from their answers."""

import pytest

from wamctl.puck import frames
from wamctl.puck.enumerations import MotorMode, SafetyMode
from wamctl.puck.properties import motor_properties, safety_properties
from wamctl.puck.supervision import (
    REASON_CYCLES,
    SILENT_CYCLES,
    STEADY_CYCLES,
    Question,
    Supervision,
)

NODES = range(1, 8)
NAMES = [f"Puck {k}" for k in NODES]
MOTOR, SAFETY = motor_properties(185), safety_properties(185)
ASK_MODULE = Question(0x00A, SAFETY["MODE"])
ASK_ALL = Question(0x404, MOTOR["MODE"])
ASK_ZERO = Question(0x00A, SAFETY["ZERO"])
ASK_PEN = Question(0x00A, SAFETY["PEN"])
ALL_SAFE = 0b11 << 26 | 0b001_001_001_001_001


@pytest.fixture
def watch():
    return Supervision(NODES, NAMES, [MOTOR] * 7, 10, SAFETY, 60.0)


def say(watch, node, name, value):
    properties = SAFETY if node == 10 else MOTOR
    return watch.hear(node, frames.encode_set(properties[name], value))


def arrive(watch):
    watch.go(wants_torque=True)
    say(watch, 10, "MODE", SafetyMode.ACTIVE)
    for node in NODES:
        assert not watch.enabled
        say(watch, node, "MODE", MotorMode.TORQUE)
    assert watch.enabled
    return watch


def questions(watch, cycles, first=1):
    asked = [watch.next_question(k) for k in range(first, first + cycles)]
    return [q for q in asked if q is not None]


def test_on_the_way_up_the_module_is_asked_until_it_is_active_then_all_pucks(watch):
    watch.go(wants_torque=True)
    assert questions(watch, 8) == [ASK_MODULE] * 3 + [ASK_ZERO]
    say(watch, 10, "MODE", SafetyMode.IDLE)
    assert questions(watch, 8) == [ASK_MODULE] * 3 + [ASK_ZERO]
    say(watch, 10, "MODE", SafetyMode.ACTIVE)
    assert questions(watch, 8) == [ASK_ALL] * 3 + [ASK_ZERO]


def test_on_the_way_down_nobody_asks_for_the_zero(watch):
    watch.go(wants_torque=False)
    assert questions(watch, 16) == [ASK_MODULE] * 8


def test_every_other_question_of_a_steady_arm_is_for_the_modules_mode(watch):
    arrive(watch)
    asked = []
    for k in range(1, 42 * STEADY_CYCLES + 1):
        question = watch.next_question(k)
        if question is not None:
            asked.append(question)
            say(watch, 10, "MODE", SafetyMode.ACTIVE)
    assert len(asked) == 42
    assert asked[0::2] == [ASK_MODULE] * 21
    rest = asked[1::2]
    assert rest.count(ASK_ZERO) == 7
    temperatures = {Question(node, MOTOR["TEMP"]) for node in NODES}
    modes = {Question(node, MOTOR["MODE"]) for node in NODES}
    assert set(rest) == {ASK_ZERO} | temperatures | modes
    assert len(set(rest)) == 15


def test_an_alarm_is_asked_about_at_once_and_only_once(watch):
    arrive(watch)
    watch.alarm()
    watch.alarm()
    assert questions(watch, 3) == [ASK_MODULE]


def test_leaving_active_yields_asks_for_the_reason_and_then_is_a_fault(watch):
    arrive(watch)
    say(watch, 10, "MODE", SafetyMode.IDLE)
    assert watch.yields
    assert watch.fault is None
    assert questions(watch, 1) == [ASK_PEN]
    say(watch, 10, "PEN", ALL_SAFE)
    assert watch.fault == "safety module went to IDLE, since Shift-Idle was pressed on the pendant"


def test_leaving_active_before_all_pucks_have_followed_is_a_fault_too(watch):
    watch.go(wants_torque=True)
    say(watch, 10, "MODE", SafetyMode.ACTIVE)
    say(watch, 3, "MODE", MotorMode.TORQUE)
    say(watch, 10, "MODE", SafetyMode.IDLE)
    assert watch.yields
    assert questions(watch, 1) == [ASK_PEN]
    say(watch, 10, "PEN", ALL_SAFE)
    assert watch.fault == "safety module went to IDLE, since Shift-Idle was pressed on the pendant"


def test_idle_is_no_fault_while_nobody_has_activated(watch):
    watch.go(wants_torque=True)
    for _ in range(3):
        say(watch, 10, "MODE", SafetyMode.IDLE)
    assert (watch.yields, watch.fault) == (False, None)


def test_the_lights_of_the_pendant_are_the_reason(watch):
    arrive(watch)
    say(watch, 10, "MODE", SafetyMode.IDLE)
    say(watch, 10, "PEN", 0b11 << 26 | 0b001_001_100_001_100)
    assert watch.fault == "safety module fell back to IDLE with a fault of velocity, voltage"


def test_lights_that_make_no_sense_are_said_to(watch):
    arrive(watch)
    say(watch, 10, "MODE", SafetyMode.IDLE)
    say(watch, 10, "PEN", 0)
    assert watch.fault == (
        "safety module fell back to IDLE (The safety module's PEN 0x00000000 has no single state "
        "for velocity, torque, voltage, heartbeat, other)"
    )


def test_a_reason_that_never_comes_is_waited_for_briefly(watch):
    arrive(watch)
    say(watch, 10, "MODE", SafetyMode.IDLE)
    questions(watch, REASON_CYCLES)
    assert watch.fault is None
    questions(watch, 1)
    assert watch.fault == "safety module fell back to IDLE, and does not say why"


def test_estop_is_a_fault_at_any_time(watch):
    say(watch, 10, "MODE", SafetyMode.ESTOP)
    assert watch.fault == "E-STOP: the safety module has cut the power of all motors"


def test_the_first_fault_stays(watch):
    say(watch, 10, "MODE", SafetyMode.ESTOP)
    say(watch, 10, "ZERO", 0)
    assert watch.fault == "E-STOP: the safety module has cut the power of all motors"


def test_a_puck_in_another_mode(watch):
    arrive(watch)
    say(watch, 4, "MODE", 9)
    assert watch.fault == "Puck 4 shows MODE 9 instead of TORQUE"


def test_on_the_way_down_nothing_is_a_fault(watch):
    arrive(watch)
    watch.go(wants_torque=False)
    say(watch, 10, "MODE", SafetyMode.IDLE)
    for node in NODES:
        assert not watch.disabled
        say(watch, node, "MODE", MotorMode.IDLE)
    assert watch.disabled
    assert watch.fault is None


def test_the_module_may_miss_a_few_questions(watch):
    arrive(watch)
    first = STEADY_CYCLES
    questions(watch, first + SILENT_CYCLES)
    assert watch.fault is None
    questions(watch, 1, first=first + SILENT_CYCLES + 1)
    assert watch.fault == "safety module has not answered for 100 cycles"


def test_urgent_questions_do_not_shorten_the_patience(watch):
    """A stall of a few cycles is the loop's to judge, by its limit on missing positions."""
    arrive(watch)
    for k in range(1, 20):
        watch.alarm()
        watch.next_question(k)
    assert watch.fault is None


def test_heat_is_no_fault(watch):
    arrive(watch)
    assert say(watch, 5, "TEMP", 60)
    assert watch.too_hot is None
    say(watch, 5, "TEMP", 61)
    assert watch.too_hot == "Puck 5 has 61 deg C, above its limit of 60.0 deg C"
    assert watch.fault is None


@pytest.mark.parametrize(
    ("node", "data"),
    [(3, b""), (3, b"\x88\0\2"), (3, b"\x85\0\2\0"), (11, b"\x88\0\2\0"), (10, b"\x88\1\2\0")],
)
def test_what_is_no_answer_is_not_taken_for_one(watch, node, data):
    assert not watch.hear(node, data)
    assert watch.modes == [None] * 7
    assert watch.safety_mode is None
