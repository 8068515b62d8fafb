"""Motors that are wired, scaled or read wrongly are found before the arm goes anywhere."""

import numpy as np
import pinocchio as pin
import pytest
from ideal_arm import Rig

from wamctl.commands import excite
from wamctl.errors import UsageError
from wamctl.safety.motor_response import ResponseRecord, fault, response


def scaled(motor, factor):
    factors = np.ones(7)
    factors[motor] = factor
    return lambda tau: factors * tau


def swapped(first, second):
    order = list(range(7))
    order[first], order[second] = second, first
    return lambda tau: tau[order]


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
    assert cause.startswith(f"motor {motor + 1} gives {factor:.1f}")
    assert "by the weight that it holds" in cause


@pytest.mark.parametrize("pair", [(0, 3), (1, 2), (4, 5), (5, 6)])
def test_motors_with_each_others_wires_are_found(wam, pair):
    found_by_test(wam, swapped(*pair))


def record(wam, motor, q_of, tau_of):
    rate = 2 * np.pi * 5.0
    phase = 2 * np.pi * np.arange(1, 101) / 100
    shape = wam.transmission.joint_from_motor[:, motor] * 0.1
    motion = np.sin(phase)[:, None] * shape
    rest = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
    return ResponseRecord(phase, motion + rest, q_of(motion) + rest, tau_of(motion, rest), rate)


def inertial_torque(wam, factor):
    """By finite differences of inverse dynamics: another hand than the one that is tested."""

    def tau(motion, rest):
        qdd = -((2 * np.pi * 5.0) ** 2) * motion
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
    assert found.scale == pytest.approx((factor, factor), rel=0.02)
    assert (fault(found, motor, 0.0) is None) == (factor == 1.0)


def test_a_dead_encoder_is_a_motor_that_does_not_move(wam):
    torque = inertial_torque(wam, 1.0)
    found = response(
        wam.robot, wam.transmission, np.zeros(7), record(wam, 2, lambda m: 1e-9 * m, torque), 2
    )
    assert fault(found, 2, 0.0) == (
        "motor 3 made +0.00 of the small motion that it was told to make (limit 0.25): look at its "
        "sign, its encoder, its wiring and its assignment"
    )


def test_the_test_is_skipped_by_name_only():
    assert excite.tests_motors("wam7", "")
    assert not excite.tests_motors("wam7", "wam7")
    with pytest.raises(UsageError) as error:
        excite.tests_motors("wam7", "yes")
    assert "'yes' is not the arm's name 'wam7'" in str(error.value)
