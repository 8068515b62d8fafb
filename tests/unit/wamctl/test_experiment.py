"""The experiment with drives and a log of the test's own: every way to end."""

from types import MappingProxyType

import numpy as np
import pinocchio as pin
import pytest

from wamctl.arm.trajectory import FourierSeries, reference
from wamctl.drives.interface import Counters, Readings
from wamctl.errors import BusStopError, RefusalError, SafetyStopError, StopError
from wamctl.experiment import phases as experiment
from wamctl.experiment.loop import Loop
from wamctl.realtime.clock import LockstepClock

PERIOD_S = 0.002
REST = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
VISCOUS = np.array([1.5, 1.0, 0.5, 0.3, 0.05, 0.05, 0.02])  # [N m s/rad]


class IdealDrives:
    """The model with rotors and some friction, behind drives that do what they are told.

    Attributes:
        accident: what happens to the readings of a cycle; called with its number.
    """

    names = tuple(f"drive {k}" for k in range(1, 8))
    delay_cycles = 1
    enabling_s, enabling_needs = 0.1, ""
    state_names = MappingProxyType({0: "OFF", 1: "ON"})

    def __init__(self, arm):
        self.counters = Counters()
        self.accident = lambda cycle, readings: readings
        self.obeys = True
        self.cycle = 0
        self.sent = []
        self._arm = arm
        self._model = pin.Model(arm.robot.model)
        self._data = self._model.createData()
        rotors = np.diag(arm.file.transmission.rotor_inertia_kg_m2)
        matrix = arm.transmission.motor_from_joint
        self._model.armature = np.diag(matrix.T @ rotors @ matrix).copy()
        self._q, self._qd = REST.copy(), np.zeros(7)
        self._torque = self._next = np.zeros(7)
        self._wanted = self._on = False

    def resting_angles(self):
        return self._arm.transmission.motor_angle(REST)

    def sample(self, timing):
        self._on = self._wanted and self.obeys
        self.cycle += 1
        angle = self._arm.transmission.motor_angle(self._q)
        readings = Readings(angle, (), self._on, not self._on, None)
        self._move()
        return self.accident(self.cycle, readings)

    def _move(self):
        self._torque = self._next if self._on else np.zeros(7)
        if not self._on:
            return
        tau = self._arm.transmission.joint_torque(self._torque)
        for _ in range(4):
            net = tau - VISCOUS * self._qd
            qdd = pin.aba(self._model, self._data, self._q, self._qd, net)
            self._qd = self._qd + PERIOD_S / 4 * qdd
            self._q = self._q + PERIOD_S / 4 * self._qd

    def send(self, tau_motor):
        self._next = tau_motor.copy()
        self.sent.append(self._next)
        return tau_motor

    def enable(self):
        self._wanted = True

    def disable(self):
        self._wanted = False

    def states(self):
        return [int(self._on)] * 7

    def cut_off(self):
        self._wanted = self._on = False

    @property
    def is_quiet(self):
        return not self._wanted and not self.sent[-1].any()


class ListLog:
    """A log in memory."""

    def __init__(self):
        self.phases, self.taus, self.qs = [], [], []
        self.failing_after = None

    @property
    def rows(self):
        return len(self.qs)

    def cycle(self, stamp_ns, q, qd, wanted, tau):
        if self.failing_after == self.rows:
            self.failing_after = None
            raise SafetyStopError("the log is full")
        self.qs.append(q)
        self.taus.append(tau)

    def status(self, stamp_ns, status, states):
        self.phases.append(status.phase)

    def progress(self, phase, done, total):
        pass


class Rig:
    """An experiment that is ready to run."""

    def __init__(self, arm, operator=lambda: None):
        self.drives, self.log = IdealDrives(arm), ListLog()
        self.loop = Loop(arm, self.drives, LockstepClock(PERIOD_S), self.log, operator)
        self._arm = arm
        series = FourierSeries(
            arm.robot.joint_names, 2 * np.pi, np.full((7, 1), 0.3), np.zeros((7, 1)), REST + 0.05
        )
        self.motion = experiment.plan(arm, REST, reference(series, 1, 0.5, PERIOD_S))

    def run(self):
        return experiment.run(self._arm, self.drives, self.loop, self.motion)

    def stopped(self):
        with pytest.raises(StopError) as stop:
            self.run()
        assert self.drives.is_quiet
        return stop.value


@pytest.fixture
def rig(wam):
    return Rig(wam)


def test_a_whole_experiment(rig):
    assert rig.run() == 500
    assert rig.log.rows == rig.drives.cycle
    assert sorted(set(rig.log.phases)) == [1, 2, 3, 4, 5]
    assert rig.drives.is_quiet


def test_torque_is_zero_until_all_drives_are_enabled(wam, rig):
    rig.drives.obeys = False

    def wake(cycle, readings):
        rig.drives.obeys = cycle >= 20
        return readings

    rig.drives.accident = wake
    rig.run()
    assert not np.any(rig.drives.sent[:20])
    assert np.any(rig.drives.sent[22])


def test_drives_that_do_not_enable(rig):
    rig.drives.obeys = False
    stop = rig.stopped()
    assert isinstance(stop, BusStopError)
    assert str(stop) == (
        "not all drives were enabled within 0.1 s (drive 1 OFF, drive 2 OFF, drive 3 OFF, drive 4 "
        "OFF, drive 5 OFF, drive 6 OFF, drive 7 OFF), 0.098 s after the first SYNC in phase "
        "'enable': the drives were disabled."
    )


def at(cycle, change):
    return lambda now, readings: change(readings) if now >= cycle else readings


def changed(readings, **what):
    return Readings(**vars(readings) | what)


def test_a_drive_fault_disables_at_once(rig):
    rig.drives.accident = at(300, lambda r: changed(r, fault="drive 3 reported EMCY 0x2310"))
    stop = rig.stopped()
    assert (stop.exit_code, stop.cause) == (4, "drive 3 reported EMCY 0x2310")
    assert stop.outcome == "the drives were disabled"
    assert not rig.drives.sent[299].any()  # the torque frame of the very cycle


def test_a_stop_switch_brakes_first(rig):
    rig.drives.accident = at(300, lambda r: changed(r, stop="the stop switch was pressed"))
    stop = rig.stopped()
    assert (stop.exit_code, stop.cause) == (5, "the stop switch was pressed")
    assert stop.outcome == "the arm was braked within 0.08 s and the drives were disabled"
    assert rig.drives.cycle == 300 + 40 + 1


def test_the_operator_stops_the_arm(wam):
    rig = Rig(wam, lambda: "the operator pressed a key" if rig.drives.cycle >= 900 else None)
    stop = rig.stopped()
    assert str(stop) == (
        "the operator pressed a key, 1.798 s after the first SYNC in phase 'excite': the arm was "
        "braked within 0.08 s and the drives were disabled."
    )
    assert np.abs(rig.loop.state.qd).max() < 0.1


def test_missing_readings_are_borne_for_a_while(wam, rig):
    def lose(cycle, readings):
        if not 300 <= cycle < 307:
            return readings
        angle = readings.angle_motor.copy()
        angle[2] = np.nan
        return changed(readings, angle_motor=angle, missing=(2,))

    rig.drives.accident = lose
    assert rig.run() == 500
    assert rig.log.rows == rig.drives.cycle - 7


def test_a_silent_drive_ends_it(wam, rig):
    def lose(readings):
        angle = readings.angle_motor.copy()
        angle[2] = np.nan
        return changed(readings, angle_motor=angle, missing=(2,))

    rig.drives.accident = at(300, lose)
    stop = rig.stopped()
    assert stop.cause == "no position from drive 3 in 8 cycles (limit 8)"
    assert stop.outcome == "the drives were disabled"


def test_a_log_that_fails_brakes_the_arm(rig):
    rig.log.failing_after = 300
    stop = rig.stopped()
    assert (stop.exit_code, stop.cause) == (5, "the log is full")
    assert "braked" in stop.outcome


def test_a_fault_while_braking_disables(rig):
    def accidents(cycle, readings):
        readings = (
            changed(readings, stop="the stop switch was pressed") if cycle >= 300 else readings
        )
        return changed(readings, fault="drive 1 is on fire") if cycle >= 310 else readings

    rig.drives.accident = accidents
    stop = rig.stopped()
    assert stop.outcome == "braking was cut short (drive 1 is on fire) and the drives were disabled"
    assert rig.drives.cycle == 311


def test_drives_that_do_not_confirm(rig):
    rig.drives.accident = at(
        300, lambda r: changed(r, fault="drive 1 reported EMCY 0x1000", disabled=False)
    )
    stop = rig.stopped()
    assert stop.outcome == "the drives were told to disable, and not all confirmed it"


def test_a_bus_that_is_gone(rig):
    def gone(readings):
        raise BusStopError("bus can0 failed (Network is down)")

    rig.drives.accident = at(300, gone)
    stop = rig.stopped()
    assert stop.outcome == "the drives were told to cut off, then bus can0 failed (Network is down)"


def test_a_start_beyond_the_limits_is_refused(wam):
    rig = Rig(wam)
    lost = REST.copy()
    lost[6] = 3.1
    with pytest.raises(RefusalError) as refused:
        experiment.plan(wam, lost, rig.motion.excitation)
    assert str(refused.value) == (
        "The move from the resting pose to the start of the excitation is refused, and no drive "
        "was enabled: position of joint 7 (wam/palm_yaw_joint) is 3.1 rad at 0.000 s, above its "
        "limit of 3 rad."
    )
