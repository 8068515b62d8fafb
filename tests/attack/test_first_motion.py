"""Motors that are wired, scaled or read wrongly are found before the arm goes anywhere."""

import re

import numpy as np
import pinocchio as pin
import pytest
from ideal_arm import REST, Rig

from wamctl.commands import excite
from wamctl.errors import UsageError
from wamctl.safety.motor_response import (
    ANY_SCALE,
    ResponseRecord,
    motion_fault,
    response,
    scale_fault,
    shown_scale,
)


def scaled(motor, factor):
    factors = np.ones(7)
    factors[motor] = factor
    return lambda tau: factors * tau


def swapped(first, second):
    order = list(range(7))
    order[first], order[second] = second, first
    return lambda tau: tau[order]


def scale_told(cause, motor):
    told = re.match(rf"motor {motor + 1} gives ([0-9.]+) times the torque", cause)
    assert told is not None, cause
    return float(told[1])


class Bristles:
    """Dahl friction of every joint, which gives like a spring for some milliradians."""

    def __init__(self, slip_rad):
        self._level = np.array([2.6, 0.9, 0.4, 1.1, 0.05, 0.05, 0.08])
        self._slip, self._z = slip_rad, np.zeros(7)

    def __call__(self, qd, seconds):
        self._z = (self._z + seconds * qd) / (1.0 + seconds * np.abs(qd) / self._slip)
        return self._level * self._z / self._slip + 0.02 * qd


class Hose:
    """Dry friction, and a hose that pulls at the elbow this way in one pose and that in another."""

    def __init__(self, drives):
        self._drives, self._stiff = drives, Bristles(0.0002)

    def __call__(self, qd, seconds):
        pull = np.zeros(7)
        pull[3] = 2.0 * np.sin(2.0 * self._drives.q[3] - 0.3)
        return self._stiff(qd, seconds) + pull


def found_by_test(wam, motors):
    rig = Rig(wam, tests_motors=True)
    rig.drives.motors = motors
    stop = rig.stopped()
    assert stop.phase == "test"
    return stop.cause, rig


def test_a_healthy_arm_passes_and_stays_where_it_is(wam):
    rig, furthest = Rig(wam, tests_motors=True), [0.0]

    def look(cycle, readings):
        if rig.loop.phase.word == "test":
            q = wam.transmission.joint_angle(readings.angle_motor)
            furthest.append(np.abs(q - rig.motion.approach.q[0]).max())
        return readings

    rig.drives.accident = look
    assert rig.run() == 500
    assert 0.003 < max(furthest) < 0.03


def test_an_arm_whose_joints_give_before_they_slide_is_healthy(wam):
    rig = Rig(wam, tests_motors=True)
    rig.drives.friction = Bristles(0.0025)
    assert rig.run() == 500


SECOND = np.array([1.4, 0.74, -0.94, 1.14, -2.91, 0.87, 1.85])


def test_an_arm_with_a_hose_at_its_elbow_is_healthy(wam):
    rig = Rig(wam, tests_motors=True, start=SECOND)
    rig.drives.friction = Hose(rig.drives)
    assert rig.run() == 500


@pytest.mark.parametrize("motor", range(7))
@pytest.mark.parametrize("factor", [-1.0, 0.0])
def test_a_motor_with_the_wrong_sign_or_none_is_found(wam, motor, factor):
    _, rig = found_by_test(wam, scaled(motor, factor))
    assert rig.drives.speed < 6.0


@pytest.mark.parametrize("motor", range(3))
def test_a_motor_with_three_times_its_torque_is_found(wam, motor):
    cause, _ = found_by_test(wam, scaled(motor, 3.0))
    assert f"motor {motor + 1} gives " in cause


@pytest.mark.parametrize(("motor", "factor"), [(1, 0.7), (2, 1.4), (3, 1.5)])
def test_the_scale_of_a_motor_that_holds_weight_is_found(wam, motor, factor):
    cause, _ = found_by_test(wam, scaled(motor, factor))
    assert scale_told(cause, motor) == pytest.approx(factor, abs=0.05)
    assert "by the weight that it holds" in cause


def test_what_a_tool_would_explain_of_an_elbow_is_found_in_a_second_pose(wam):
    rig = Rig(wam, tests_motors=True, start=SECOND)
    rig.drives.motors = scaled(3, 0.7)
    stop = rig.stopped()
    assert stop.phase == "approach"
    assert scale_told(stop.cause, 3) == pytest.approx(0.7, abs=0.05)
    assert "the drives were disabled" in stop.outcome


@pytest.mark.parametrize("pair", [(0, 3), (1, 2), (4, 5), (5, 6)])
def test_motors_with_each_others_wires_are_found(wam, pair):
    found_by_test(wam, swapped(*pair))


def record(wam, motor, q_of, tau_of, hz=5.0):
    rate = 2 * np.pi * hz
    phase = 2 * np.pi * np.arange(1, 101) / 100
    shape = wam.transmission.joint_from_motor[:, motor] * 0.1
    motion = np.sin(phase)[:, None] * shape
    return ResponseRecord(phase, motion + REST, q_of(motion) + REST, tau_of(motion, REST), rate)


def inertial_torque(wam, factor, hz=5.0):
    """By finite differences of inverse dynamics: another hand than the one that is tested."""

    def tau(motion, rest):
        qdd = -((2 * np.pi * hz) ** 2) * motion
        model, data = wam.robot.model, wam.robot.data()
        zero = np.zeros(7)
        return np.array(
            [
                pin.rnea(model, data, rest + dq, zero, a) / factor
                for dq, a in zip(motion, qdd, strict=True)
            ]
        )

    return tau


@pytest.mark.parametrize("motor", range(7))
@pytest.mark.parametrize("factor", [0.4, 1.0, 2.0])
def test_the_scale_is_that_of_the_motor_whatever_the_friction(wam, motor, factor):
    torque = inertial_torque(wam, factor)

    def tau(motion, rest):
        speed = np.cos(2 * np.pi * np.arange(1, 101) / 100)[:, None]
        return torque(motion, rest) + 0.7 * np.tanh(speed / 0.2) * np.ones(7)

    found = response(
        wam.robot, wam.transmission, np.zeros(7), record(wam, motor, lambda m: m, tau), motor
    )
    assert found.motion == pytest.approx(1.0)
    shown = shown_scale(found)
    assert shown == pytest.approx((factor, factor), rel=0.02)
    assert (scale_fault(shown, motor) is None) == (factor == 1.0)


@pytest.mark.parametrize(("spring_nm_rad", "tells"), [(0.0, True), (100.0, False)])
def test_a_scale_that_is_another_one_at_another_rate_is_none_of_the_motor(
    wam, spring_nm_rad, tells
):
    """A joint that gives like a spring seems to have a motor with too much torque."""

    def answer(hz):
        inertia, spring = inertial_torque(wam, 2.0, hz), spring_nm_rad * np.eye(7)[0]
        given = record(wam, 0, lambda m: m, lambda m, rest: inertia(m, rest) + m * spring, hz)
        return response(wam.robot, wam.transmission, np.zeros(7), given, 0)

    assert scale_fault(shown_scale(answer(5.0)), 0) is not None
    shown = shown_scale(answer(5.0), answer(2.5))
    assert shown == (pytest.approx((2.0, 2.0), rel=0.02) if tells else ANY_SCALE)


def test_friction_that_hides_all_inertia_tells_no_scale(wam):
    inertia = inertial_torque(wam, 1.0)
    given = record(wam, 0, lambda m: m, lambda m, rest: -0.1 * inertia(m, rest))
    found = response(wam.robot, wam.transmission, np.zeros(7), given, 0)
    assert shown_scale(found) == ANY_SCALE


def test_a_dead_encoder_is_a_motor_that_does_not_move(wam):
    torque = inertial_torque(wam, 1.0)
    found = response(
        wam.robot, wam.transmission, np.zeros(7), record(wam, 2, lambda m: 1e-9 * m, torque), 2
    )
    assert motion_fault(found, 2) == (
        "motor 3 made +0.00 of the small motion that it was told to make (limit 0.25): look at its "
        "sign, its encoder, its wiring and its assignment"
    )


def test_the_test_is_skipped_by_name_only():
    assert excite.tests_motors("wam7", "")
    assert not excite.tests_motors("wam7", "wam7")
    with pytest.raises(UsageError) as error:
        excite.tests_motors("wam7", "yes")
    assert "'yes' is not the arm's name 'wam7'" in str(error.value)
