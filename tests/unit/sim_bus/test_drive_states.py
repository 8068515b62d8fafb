"""The CiA 402 machine of a drive, its torque and its errors."""

import struct

import pytest

from sim_bus.can_bus.frame import Frame
from sim_bus.canopen.ds402 import State, follow

S = State
COMMANDS = {
    "shutdown": 0x06,
    "switch on": 0x07,
    "enable operation": 0x0F,
    "disable voltage": 0x00,
    "quick stop": 0x02,
    "fault reset": 0x80,
}
STATES = (
    S.SWITCH_ON_DISABLED,
    S.READY_TO_SWITCH_ON,
    S.SWITCHED_ON,
    S.OPERATION_ENABLED,
    S.QUICK_STOP_ACTIVE,
    S.FAULT,
)
# Rows as in the standard: the state after each command, from the states in the order above.
AFTER = {
    "shutdown": (
        S.READY_TO_SWITCH_ON,
        S.READY_TO_SWITCH_ON,
        S.READY_TO_SWITCH_ON,
        S.READY_TO_SWITCH_ON,
        S.QUICK_STOP_ACTIVE,
        S.FAULT,
    ),
    "switch on": (
        S.SWITCH_ON_DISABLED,
        S.SWITCHED_ON,
        S.SWITCHED_ON,
        S.SWITCHED_ON,
        S.QUICK_STOP_ACTIVE,
        S.FAULT,
    ),
    "enable operation": (
        S.SWITCH_ON_DISABLED,
        S.OPERATION_ENABLED,
        S.OPERATION_ENABLED,
        S.OPERATION_ENABLED,
        S.OPERATION_ENABLED,
        S.FAULT,
    ),
    "disable voltage": (S.SWITCH_ON_DISABLED,) * 5 + (S.FAULT,),
    "quick stop": (
        S.SWITCH_ON_DISABLED,
        S.SWITCH_ON_DISABLED,
        S.SWITCH_ON_DISABLED,
        S.QUICK_STOP_ACTIVE,
        S.QUICK_STOP_ACTIVE,
        S.FAULT,
    ),
    "fault reset": (S.SWITCH_ON_DISABLED,) * 6,
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_from_every_state(command):
    reached = tuple(follow(state, COMMANDS[command], 0, True) for state in STATES)
    assert reached == AFTER[command]


def test_a_fault_is_reset_by_a_rising_edge_only_and_when_its_cause_has_gone():
    assert follow(S.FAULT, 0x80, 0x80, True) == S.FAULT
    assert follow(S.FAULT, 0x80, 0x00, False) == S.FAULT
    assert follow(S.FAULT, 0x8F, 0x0F, True) == S.SWITCH_ON_DISABLED


def torque(bench, permille):
    bench.send(0x200, struct.pack("<4h", 0, 0, permille, 0))
    bench.send(0x080)
    return bench.drive.motor_torque_nm


def test_torque_is_in_steps_of_rated_torque(bench):
    bench.enable()
    assert torque(bench, 1) == pytest.approx(1.49e-3)
    assert torque(bench, -1000) == pytest.approx(-1.49)


def test_torque_is_clamped_by_0x6072_and_says_so(bench):
    bench.enable()
    bench.write(0x6072, 0, 300, 2)
    assert torque(bench, 301) == pytest.approx(0.3 * 1.49)
    assert bench.statusword & 0x0800
    assert torque(bench, -5000) == pytest.approx(-0.3 * 1.49)
    assert torque(bench, 300) == pytest.approx(0.3 * 1.49)
    assert not bench.statusword & 0x0800


def test_the_offset_is_added(bench):
    bench.enable()
    bench.write(0x60B2, 0, -50, 2)
    assert torque(bench, 200) == pytest.approx(0.15 * 1.49)


@pytest.mark.parametrize("word", [0x00, 0x02, 0x06, 0x07])
def test_no_torque_outside_operation_enabled(bench, word):
    bench.enable()
    assert torque(bench, 400) != 0.0
    bench.write(0x6040, 0, word, 2)
    assert bench.drive.motor_torque_nm == 0.0
    assert torque(bench, 400) == 0.0


def test_no_torque_without_the_torque_mode(bench):
    bench.enable()
    bench.write(0x6060, 0, 0, 1)
    assert torque(bench, 400) == 0.0


def test_a_fault_takes_the_torque_away_and_stays_until_it_is_reset(bench):
    bench.enable()
    torque(bench, 400)
    bench.drive.fail(bench.now_ns, 0x4310)
    assert bench.drive.motor_torque_nm == 0.0
    assert bench.read(0x603F) == 0x4310
    assert bench.read(0x1001) == 0x09
    assert bench.statusword & 0x4F == 0x08
    bench.write(0x6040, 0, 0x0F, 2)
    assert bench.statusword & 0x4F == 0x08
    bench.write(0x6040, 0, 0x80, 2)
    assert bench.statusword & 0x4F == 0x40
    assert bench.read(0x603F) == 0
    assert bench.read(0x1001) == 0
    assert bench.read(0x1003, 1) == 0x4310
    assert Frame(0x083, bytes(8)) in bench.frames


def test_a_fault_is_an_emergency_message(bench):
    bench.enable()
    (emergency,) = bench.drive.fail(bench.now_ns, 0x3220)
    assert emergency == Frame(0x083, struct.pack("<HB5x", 0x3220, 0x05))


def test_the_error_history_shows_the_newest_first_and_is_cleared(bench):
    for code in (0x2310, 0x4210, 0x7320):
        bench.drive.fail(bench.now_ns, code)
    assert bench.read(0x1003) == 3
    assert [bench.read(0x1003, k) for k in (1, 2, 3, 4)] == [0x7320, 0x4210, 0x2310, 0]
    assert bench.write(0x1003, 0, 0, 1) is None
    assert bench.read(0x1003) == 0
    assert bench.read(0x1003, 1) == 0


def test_a_lost_sync_faults_only_when_asked_to(bench):
    bench.enable()
    torque(bench, 400)
    assert bench.wait(100) == []
    assert bench.drive.motor_torque_nm != 0.0
    bench.write(0x2406, 0, 20, 2)
    bench.send(0x080)
    assert bench.wait(19.9) == []
    assert bench.wait(0.2) == [Frame(0x083, struct.pack("<HB5x", 0x8700, 0x11))]
    assert bench.drive.motor_torque_nm == 0.0


def test_an_idle_drive_needs_no_sync(bench):
    bench.enable()
    bench.write(0x2406, 0, 20, 2)
    bench.write(0x6040, 0, 0x06, 2)
    assert bench.wait(500) == []
