"""An arm of the test's own: ideal drives, a log in memory, and an experiment ready to run."""

from types import MappingProxyType

import numpy as np
import pinocchio as pin
import pytest

from wamctl.arm.trajectory import FourierSeries, reference
from wamctl.drives.interface import Counters, Readings
from wamctl.errors import SafetyStopError, StopError
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
        motors: what the motors make of the torques that are sent, [N m] to [N m].
        friction: of joints with a speed, for a time [s], [rad/s] to [N m].
    """

    names = tuple(f"drive {k}" for k in range(1, 8))
    delay_cycles = 1
    enabling_s, enabling_needs = 0.1, ""
    state_names = MappingProxyType({0: "OFF", 1: "ON"})

    def __init__(self, arm):
        self.counters = Counters()
        self.accident = lambda cycle, readings: readings
        self.motors = lambda tau_motor: tau_motor
        self.friction = lambda qd, seconds: VISCOUS * qd
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
        tau = self._arm.transmission.joint_torque(self.motors(self._torque))
        for _ in range(4):
            net = tau - self.friction(self._qd, PERIOD_S / 4)
            qdd = pin.aba(self._model, self._data, self._q, self._qd, net)
            self._qd = self._qd + PERIOD_S / 4 * qdd
            self._q = self._q + PERIOD_S / 4 * self._qd

    def send(self, tau_motor, at_once=False):
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
        self.sent.append(np.zeros(7))

    @property
    def q(self):
        """Where the joints are [rad]."""
        return self._q

    @property
    def speed(self):
        """Of the fastest joint [rad/s]."""
        return np.abs(self._qd).max()

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

    def __init__(self, arm, operator=lambda: None, tests_motors=False, start=REST + 0.05):
        self.tests_motors = tests_motors
        self.drives, self.log = IdealDrives(arm), ListLog()
        self.loop = Loop(arm, self.drives, LockstepClock(PERIOD_S), self.log, operator)
        self._arm = arm
        series = FourierSeries(
            arm.robot.joint_names, 2 * np.pi, np.full((7, 1), 0.3), np.zeros((7, 1)), start
        )
        self.motion = experiment.plan(arm, REST, reference(series, 1, 0.5, PERIOD_S))

    def run(self):
        return experiment.run(
            self._arm, self.drives, self.loop, self.motion, tests_motors=self.tests_motors
        )

    def stopped(self):
        with pytest.raises(StopError) as stop:
            self.run()
        assert self.drives.is_quiet
        return stop.value
