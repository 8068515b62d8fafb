"""One cycle: wait, sample, check, compute, gate, send, log."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.config import ArmFile
from wamctl.arm.control import ComputedTorque, Setpoint
from wamctl.arm.robot import Robot
from wamctl.arm.transmission import Transmission
from wamctl.drives.interface import Drives, Readings
from wamctl.errors import BusStopError, OutsideStopError, StopError
from wamctl.realtime.clock import Clock
from wamctl.realtime.latency import Timing
from wamctl.safety.bad_cycles import BadCycleCounter
from wamctl.safety.motor_faults import MotorFaults
from wamctl.safety.state_estimator import ArmState, StateEstimator
from wamctl.safety.state_limits import StateLimits
from wamctl.safety.torque_gate import TorqueGate
from wamctl.safety.watchdog import NOBODY_WATCHES, Heart
from wamctl.telemetry.logger import Logger
from wamctl.telemetry.status import LoopStatus, Phase

Law = Callable[[ArmState], tuple[Setpoint, Array]]
"""From the arm's state to the reference and the joint torque [N m], shape (n,)."""

Check = Callable[[ArmState], None]
"""A check of the arm's state that one phase adds to the others."""

_STATUS_S = 0.1


def _no_check(state: ArmState) -> None:
    """Nothing beyond what the level of a cycle says."""


class CheckLevel(IntEnum):
    """What a cycle checks besides its torque; each level includes those below."""

    NOTHING = 0
    DRIVES = 1
    MOTION = 2
    TRACKING = 3


@dataclass(frozen=True)
class Arm:
    """The arm as the loop needs it: what was configured, and what follows from it."""

    file: ArmFile
    robot: Robot
    transmission: Transmission
    control: ComputedTorque


class Loop:
    """The only place that commands torque.

    Args:
        arm: limits, model, control law.
        drives: the motor controllers, set up and started.
        clock: paces the cycles.
        log: where each cycle goes.
        operator: why the operator wants to stop; None while he does not.
        heart: beats once a cycle, for whoever watches the loop.

    Attributes:
        wanted: the reference of the last cycle.
    """

    def __init__(
        self,
        arm: Arm,
        drives: Drives,
        clock: Clock,
        log: Logger,
        operator: Callable[[], str | None],
        heart: Heart = NOBODY_WATCHES,
    ) -> None:
        file = arm.file
        self.heart = heart
        self.phase = Phase.IDLE
        self.timing = Timing()
        self._arm, self._drives, self._clock, self._log = arm, drives, clock, log
        self._operator = operator
        self._estimator = StateEstimator(
            arm.transmission, file.controller.velocity_cutoff_hz, drives.resting_angles()
        )
        self._limits = StateLimits(file, arm.robot, arm.transmission)
        self._motors = MotorFaults(file, arm.robot, arm.transmission)
        self._gate = TorqueGate(
            np.array(file.limits.motor_torque_nm),
            np.array(file.limits.motor_torque_slew_nm_s),
            file.limits.power_w,
        )
        self._status_cycles = max(1, round(_STATUS_S / file.bus.period_s))
        self._sent: list[Array] = [np.zeros(arm.robot.dof)] * (drives.delay_cycles + 1)
        self._bad_cycles = BadCycleCounter(
            drives.names, file.safety.missed_cycles, file.safety.answers_in_order
        )
        self._first_ns = self._last_ns = 0
        zero = np.zeros(arm.robot.dof)
        self.wanted = Setpoint(self.state.q, zero, zero)

    @property
    def state(self) -> ArmState:
        """The arm's state in the last cycle."""
        return self._estimator.state

    @property
    def rows(self) -> int:
        """Cycles logged so far."""
        return self._log.rows

    def show(self, phase: Phase, done: int, total: int) -> None:
        """Progress within a phase, for whoever shows it."""
        self._log.progress(phase, done, total)

    def cycles(self, duration_s: float) -> int:
        """Number of cycles in a time [s]."""
        return round(duration_s / self._arm.file.bus.period_s)

    def cycle(
        self, law: Law, level: CheckLevel, phase: Phase, check: Check = _no_check
    ) -> Readings:
        """One period of the experiment.

        Args:
            law: from the arm's state to the torque.
            level: what is checked before torque is sent.
            phase: what the arm is doing.
            check: what else is checked; raises `StopError`.

        Raises:
            StopError: a limit, a drive, the operator or the log ended it.
        """
        self.phase = phase
        try:
            return self._cycle(law, level, check)
        except StopError as stop:
            self.stamp(stop)
            raise

    def stamp(self, stop: StopError) -> None:
        """Let an error know when it happened."""
        stop.at_s = (self._last_ns - self._first_ns) * 1e-9
        stop.phase = self.phase.word

    def _cycle(self, law: Law, level: CheckLevel, check: Check) -> Readings:
        stamp_ns, elapsed_s = self._next_instant()
        self.heart.beat()
        readings = self._drives.sample(self._clock)
        self._clock.patient = not readings.missing
        state = self._estimator.update(readings, elapsed_s)
        if level >= CheckLevel.DRIVES:
            self._check_drives(readings)
            self._limits.check_readings(state.angle_motor, elapsed_s)
        if level >= CheckLevel.MOTION:
            self._check_host(readings)
            self._limits.check(state)
        check(state)
        self.wanted, tau = law(state)
        if level >= CheckLevel.TRACKING:
            self._limits.check_tracking(state, self.wanted)
            self._motors.check(state, self.acting, elapsed_s)
            self._gate.silent = self._motors.doubtful
        else:
            self._motors.rest()
        self._sent = [*self._sent[1:], self._sent_torque(tau, elapsed_s)]
        self._record(stamp_ns, state, self.wanted)
        return readings

    def let_go_of_suspects(self) -> None:
        """No torque from now on of motors whose motion may not show the torque that was sent."""
        self._gate.silent = self._motors.suspects

    def send_instead(self, law: Law) -> None:
        """Other torque, at once, than what the last cycle asked for.

        Raises:
            StopError: the gate does not let it pass, or the bus does not send.
        """
        _, tau = law(self.state)
        self._sent[-1] = self._sent_torque(tau, self._arm.file.bus.period_s, at_once=True)

    def _sent_torque(self, tau: Array, elapsed_s: float, at_once: bool = False) -> Array:
        joints = self._arm.transmission
        speed = joints.motor_angle(self.state.qd)
        admitted = self._gate.admit(joints.motor_torque(tau), speed, elapsed_s)
        return self._drives.send(admitted, at_once)

    def send_zero_torque(self) -> None:
        """No torque, at once, whatever the last cycle asked for.

        Raises:
            BusStopError: the bus does not send.
        """
        self._drives.disable()
        self._sent[-1] = self._drives.send(self._gate.zero(), at_once=True)

    @property
    def acting(self) -> Array:
        """Joint torque that acts between the last instant and the next [N m], shape (n,)."""
        return self._arm.transmission.joint_torque(self._sent[0])

    def _next_instant(self) -> tuple[int, float]:
        stamp_ns = self._clock.tick()
        last_ns = self._last_ns or stamp_ns - round(self._arm.file.bus.period_s * 1e9)
        self._first_ns = self._first_ns or stamp_ns
        self._last_ns = stamp_ns
        return stamp_ns, (stamp_ns - last_ns) * 1e-9

    def _check_drives(self, readings: Readings) -> None:
        if self.heart.has_been_taken_for_dead:
            raise BusStopError(
                "the watchdog process has taken torque away, since the loop had stood still"
            )
        if readings.fault is not None:
            raise BusStopError(readings.fault)
        cause = self._bad_cycles.note(readings, self._clock.waited)
        if cause is not None:
            raise BusStopError(cause)

    def _check_host(self, readings: Readings) -> None:
        reason = self._operator() or readings.stop
        if reason is not None:
            raise OutsideStopError(reason)
        skipped, limit = self._clock.skipped, self._arm.file.safety.missed_cycles
        if skipped > limit:
            held_ms = self._clock.latency_ns * 1e-6
            raise OutsideStopError(
                f"this computer held the loop up for {held_ms:.1f} ms, {skipped} cycles "
                f"(limit {limit})"
            )

    def _record(self, stamp_ns: int, state: ArmState, wanted: Setpoint) -> None:
        clock, timing = self._clock, self.timing
        cycle_ns = clock.elapsed_ns()
        timing.record(clock.latency_ns, cycle_ns, clock.skipped)
        if state.complete:
            self._log.cycle(stamp_ns, state.q, state.qd, wanted, self.acting)
        if timing.cycles % self._status_cycles == 1:
            bad = self._drives.counters
            status = LoopStatus(
                self.phase,
                timing.cycles,
                timing.missed,
                bad.lost,
                bad.late,
                bad.malformed + bad.foreign,
                clock.latency_ns * 1e-3,
                cycle_ns * 1e-3,
                self._gate.clipped,
            )
            self._log.status(stamp_ns, status, self._drives.states())
