"""The torque gate and the guard."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wamctl.arm.control import Setpoint
from wamctl.errors import SafetyStopError
from wamctl.safety.state_estimator import ArmState
from wamctl.safety.state_limits import StateLimits
from wamctl.safety.torque_gate import TorqueGate

LIMIT, SLEW, PERIOD_S = np.array([1.8, 0.6]), np.array([200.0, 80.0]), 0.002
REST = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
ZERO = np.zeros(7)


@given(st.lists(arrays(float, 2, elements=st.floats(-1e6, 1e6)), min_size=1, max_size=20))
def test_no_torque_passes_limit_or_slew(wanted):
    gate, last = TorqueGate(LIMIT, SLEW), np.zeros(2)
    for tau in wanted:
        passed = gate.admit(tau, np.zeros(2), PERIOD_S)
        assert (np.abs(passed) <= LIMIT).all()
        assert (np.abs(passed - last) <= SLEW * PERIOD_S + 1e-12).all()
        last = passed


def test_a_torque_within_the_limits_passes_unchanged():
    gate = TorqueGate(LIMIT, SLEW)
    assert gate.admit(np.array([0.3, -0.1]), np.zeros(2), PERIOD_S) == pytest.approx([0.3, -0.1])
    assert gate.clipped == 0
    gate.admit(np.array([2.0, -0.1]), np.zeros(2), PERIOD_S)
    assert gate.clipped == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_stops_the_arm(bad):
    gate = TorqueGate(LIMIT, SLEW)
    with pytest.raises(SafetyStopError) as stop:
        gate.admit(np.array([0.0, bad]), np.zeros(2), PERIOD_S)
    assert stop.value.cause == f"torque of motor 2 came out as {bad} N m, not a number"
    assert not stop.value.brakes


def test_too_much_power_passes_neither_way_of_turning():
    gate = TorqueGate(LIMIT, SLEW, power_w=4.2)
    speed = np.array([20.0, -10.0])
    passed = gate.admit(np.array([0.2, 0.1]), speed, PERIOD_S)  # 4 W in, 1 W out
    with pytest.raises(SafetyStopError) as stop:
        gate.admit(np.array([0.2, -0.05]), speed, PERIOD_S)
    assert stop.value.cause == "the motors would put 4.5 W into the arm, above the limit of 4.2 W"
    assert stop.value.brakes
    braking = gate.admit(np.array([-0.1, 0.1]), speed, PERIOD_S)
    assert (passed.tolist(), braking.tolist()) == ([0.2, 0.1], [-0.1, 0.1])


def test_zero_is_zero_at_once():
    gate = TorqueGate(LIMIT, SLEW)
    gate.admit(np.array([0.3, 0.1]), np.zeros(2), PERIOD_S)
    assert gate.zero().tolist() == [0.0, 0.0]


@pytest.fixture
def guard(wam):
    return StateLimits(wam.file, wam.robot, wam.transmission)


def state(wam, q=REST, qd=ZERO):
    q = np.array(q, dtype=float)
    return ArmState(q, np.array(qd, dtype=float), wam.transmission.motor_angle(q), True)


def moved(place, value, base=REST):
    out = base.copy()
    out[place] = value
    return out


def cause_of(action):
    with pytest.raises(SafetyStopError) as stop:
        action()
    return stop.value.cause, stop.value.brakes


def test_within_the_limits_nothing_happens(wam, guard):
    guard.check(state(wam, qd=0.3 * np.ones(7)))
    guard.check_tracking(state(wam), Setpoint(REST + 0.3, ZERO, ZERO))


def test_a_position_beyond_its_limit(wam, guard):
    cause = cause_of(lambda: guard.check(state(wam, moved(3, 3.16))))
    assert cause == (
        "position of joint 4 (elbow pitch) is 3.160 rad, above its limit of 3.150 rad",
        True,
    )


def test_a_position_that_braking_would_lead_beyond_its_limit(wam, guard):
    """From 2 rad/s, 0.08 s of braking take 0.08 rad."""
    guard.check(state(wam, moved(3, 3.06), moved(3, 2.0, ZERO)))
    cause, _ = cause_of(lambda: guard.check(state(wam, moved(3, 3.08), moved(3, 2.0, ZERO))))
    assert cause == (
        "position of joint 4 (elbow pitch) comes by braking to 3.160 rad, above its limit of "
        "3.150 rad"
    )


def test_a_velocity_beyond_its_limit(wam, guard):
    cause = cause_of(lambda: guard.check(state(wam, qd=moved(6, -4.0, ZERO))))
    assert cause == (
        "velocity of joint 7 (palm yaw) is -4.000 rad/s, below its limit of -3.750 rad/s",
        True,
    )


def test_a_velocity_is_judged_by_where_it_is_and_not_by_where_its_filter_has_it(wam, guard):
    """The filter of 40 Hz lags by two cycles."""
    guard.check(state(wam, qd=moved(6, 3.0, ZERO)))
    cause, _ = cause_of(lambda: guard.check(state(wam, qd=moved(6, 3.4, ZERO))))
    assert cause.startswith("velocity of joint 7 (palm yaw) is 4.196 rad/s, above")


def test_a_tool_that_is_too_fast(wam, guard):
    cause, brakes = cause_of(lambda: guard.check(state(wam, ZERO, moved(1, 1.5, ZERO))))
    assert cause == "speed of wam/link7_dh is 1.365 m/s, above its limit of 1.000 m/s"
    assert brakes


def test_an_arm_with_too_much_energy(wam):
    limits = wam.file.limits.model_copy(update={"kinetic_energy_j": 0.5, "tool_speed_m_s": 9.0})
    guard = StateLimits(wam.file.model_copy(update={"limits": limits}), wam.robot, wam.transmission)
    guard.check(state(wam, ZERO, moved(1, 0.3, ZERO)))
    cause, brakes = cause_of(lambda: guard.check(state(wam, ZERO, moved(1, 1.0, ZERO))))
    inertia = pin.crba(wam.robot.model, wam.robot.data(), ZERO)[1, 1]
    assert cause == (f"kinetic energy of the arm is {inertia / 2:.2f} J, above its limit of 0.5 J")
    assert brakes


def test_an_arm_that_does_not_follow(wam, guard):
    wanted = Setpoint(moved(0, 0.51), ZERO, ZERO)
    assert cause_of(lambda: guard.check_tracking(state(wam), wanted)) == (
        "tracking error of joint 1 (base yaw) is 0.510 rad, above its limit of 0.500 rad",
        True,
    )


def test_an_encoder_that_jumps_cannot_be_braked_by(wam, guard):
    angle = wam.transmission.motor_angle(REST)
    guard.check_readings(angle, PERIOD_S)
    glitch = moved(3, angle[3] + 1000 / 4096 * 2 * np.pi, angle)
    assert cause_of(lambda: guard.check_readings(glitch, PERIOD_S)) == (
        "position of motor 4 jumped by 1.534 rad in 2.0 ms (limit 0.216 rad)",
        False,
    )


def test_the_fastest_allowed_motion_is_no_jump(wam, guard):
    fastest = 1.5 * np.array(wam.file.limits.velocity_rad_s)
    for k in range(10):
        angle = wam.transmission.motor_angle(REST + fastest * k * PERIOD_S)
        guard.check_readings(angle, PERIOD_S)


def follow(wam, guard, cycles, encoder):
    """An arm that follows its reference at 1 rad/s, seen through an encoder."""
    for k in range(cycles):
        q = REST + k * PERIOD_S
        angle = encoder(wam.transmission.motor_angle(q))
        guard.check_readings(angle, PERIOD_S)
        seen = ArmState(wam.transmission.joint_angle(angle), ZERO, angle, True)
        guard.check_tracking(seen, Setpoint(q, ZERO, ZERO))


def test_a_moving_encoder_is_not_stuck(wam, guard):
    follow(wam, guard, 400, lambda angle: angle)


def test_a_stuck_encoder_is_noticed_before_the_joint_is_lost(wam, guard):
    frozen = wam.transmission.motor_angle(REST)[0]
    cause, brakes = cause_of(lambda: follow(wam, guard, 400, lambda angle: moved(0, frozen, angle)))
    assert cause == (
        "encoder of motor 1 stands still while its reference went 10.58 rad (limit 10.50 rad)"
    )
    assert not brakes
