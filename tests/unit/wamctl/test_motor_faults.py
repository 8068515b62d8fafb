"""Torque, reading and motion of each motor against each other."""

import numpy as np
import pinocchio as pin
import pytest

from wamctl.drives.interface import Readings
from wamctl.errors import SafetyStopError
from wamctl.safety.motor_faults import MotorFaults
from wamctl.safety.state_estimator import StateEstimator
from wamctl.safety.torque_residual import TorqueResidual

PERIOD_S = 0.002
REST = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
AMPLITUDE, RATE = np.array([0.4, 0.2, 0.2, 0.2, 0.3, 0.05, 0.3]), 3.0
COULOMB = np.array([1.9, 0.63, 0.28, 0.94, 0.036, 0.043, 0.076])


class MovingArm:
    """An arm that the model describes, but for friction, on a smooth path; encoders count."""

    def __init__(self, wam):
        self._wam, self._data = wam, wam.robot.data()
        self.gives = np.ones(7)  # share of its torque that each motor needs to be told
        self.shaken_nm = np.zeros(7)  # torque of each motor to and fro, which no motion shows
        self.stuck = None
        self._estimator = StateEstimator(wam.transmission, 40.0, self._angle(REST))
        self._held = self._angle(REST)

    def _angle(self, q):
        count = 2 * np.pi / 4096
        return np.rint(self._wam.transmission.motor_angle(q) / count) * count

    def cycle(self, k):
        """State and the joint torque that was told since the last one."""
        t = k * PERIOD_S
        q = REST + AMPLITUDE * (1 - np.cos(RATE * t))
        qd = AMPLITUDE * RATE * np.sin(RATE * t)
        qdd = AMPLITUDE * RATE**2 * np.cos(RATE * t)
        tau = pin.rnea(self._wam.robot.model, self._data, q, qd, qdd) + COULOMB * np.sign(qd)
        told = self._wam.transmission.motor_torque(tau) * self.gives
        told += self.shaken_nm * np.sin(2 * np.pi * 37.0 * t)
        angle = self._angle(q)
        if self.stuck is not None:
            angle[self.stuck] = self._held[self.stuck]
        self._held = angle
        state = self._estimator.update(Readings(angle, (), True, False, None), PERIOD_S)
        return state, self._wam.transmission.joint_torque(told)


@pytest.fixture
def arm(wam):
    return MovingArm(wam)


@pytest.fixture
def watch(wam):
    return MotorFaults(wam.file, wam.robot, wam.transmission)


def watched(arm, watch, cycles):
    """The stop, and the cycle in which it came; None if it did not."""
    for k in cycles:
        try:
            watch.check(*arm.cycle(k), PERIOD_S)
        except SafetyStopError as stop:
            return stop, k
    return None


def test_what_friction_takes_is_left_over(wam, arm):
    residual = TorqueResidual(wam.robot, wam.transmission, 40.0)
    left = [residual.update(*arm.cycle(k), PERIOD_S) for k in range(400)][-1]
    moving = np.sign(np.sin(RATE * 400 * PERIOD_S))
    friction = wam.transmission.motor_torque(COULOMB * moving)
    assert left == pytest.approx(friction, abs=0.02)


def test_a_healthy_arm_is_left_alone(arm, watch):
    assert watched(arm, watch, range(3000)) is None


def test_a_motor_that_gives_no_torque_is_told_much_more(arm, watch):
    assert watched(arm, watch, range(200)) is None
    arm.gives[3] = 6.0
    stop, k = watched(arm, watch, range(200, 300))
    assert stop.cause.startswith("motor 4 does not move as it is driven: 0.")
    assert stop.cause.endswith(" N m of its torque are left over (limit 0.6 N m)")
    assert stop.brakes
    assert k < 250


def test_an_arm_that_its_loop_shakes_is_told_as_one(arm, watch):
    assert watched(arm, watch, range(200)) is None
    for k in range(200, 400):
        arm.shaken_nm[2] += 0.03
        if (found := watched(arm, watch, [k])) is not None:
            break
    assert found[0].cause.startswith("motor 3 does not move as it is driven: 0.")
    assert found[0].cause.endswith(
        " N m of its torque are left over (limit 0.5 N m), this way and that: the arm shakes, as "
        "where a joint gives way and controller.bandwidth_rad_s is too high for it"
    )


@pytest.mark.parametrize("motor", range(7))
def test_an_encoder_that_stops_at_once_is_noticed_in_six_cycles(wam, watch, arm, motor):
    assert watched(arm, watch, range(250)) is None
    arm.stuck = motor
    stop, k = watched(arm, watch, range(250, 300))
    assert f"motor {motor + 1}" in stop.cause or "does not move as it is driven" in stop.cause
    assert not stop.brakes
    assert k <= 255


def test_the_sentence_of_an_encoder_that_stops_at_once(arm, watch):
    watched(arm, watch, range(250))
    arm.stuck = 6
    stop, _ = watched(arm, watch, range(250, 300))
    assert stop.cause == (
        "encoder of motor 7 stopped at once from 13.8 rad/s and has stood still for 6 cycles, "
        "which no motor can (limit 5.8 rad/s)"
    )


def test_a_reading_that_repeats_is_borne_for_five_cycles(arm, watch):
    watched(arm, watch, range(250))
    for start in range(250, 290, 10):
        arm.stuck = 6
        assert watched(arm, watch, range(start, start + 5)) is None
        arm.stuck = None
        assert watched(arm, watch, range(start + 5, start + 10)) is None


def test_an_arm_that_rests_need_not_obey(arm, watch):
    watched(arm, watch, range(200))
    arm.gives[3] = 6.0
    for k in range(200, 300):
        arm.cycle(k)
        watch.rest()
    arm.gives[3] = 1.0
    assert watched(arm, watch, range(300, 400)) is None
