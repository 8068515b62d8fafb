"""The experiment from enabling the drives to disabling them, in the order in which it happens."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wamctl.arm.collision import collision_shapes
from wamctl.arm.control import Setpoint
from wamctl.arm.joint_labels import numbered_joints
from wamctl.arm.motion import brake, move
from wamctl.arm.trajectory import Reference
from wamctl.arm.trajectory_check import quantities, violations
from wamctl.drives.interface import Drives
from wamctl.errors import BusStopError, OutsideStopError, RefusalError, SafetyStopError, StopError
from wamctl.experiment.first_motion import first_motion, second_motion
from wamctl.experiment.loop import Arm, Array, CheckLevel, Law, Loop
from wamctl.safety.braking import BrakingMonitor
from wamctl.safety.state_estimator import ArmState
from wamctl.telemetry.status import Phase

AT_REST_RAD = 0.03
"""By so much may a joint sag or be touched between two looks at the resting arm; more means that
somebody has moved the arm or an encoder has lost its zero, which nothing here can tell apart."""

_UNTESTED = (Phase.ENABLE, Phase.TEST)  # in which no motor is to be believed yet
_RELEASE_S = 1.0
_DISABLE_S = 0.02
_PROGRESS_CYCLES = 25


@dataclass(frozen=True)
class Motion:
    """All that the arm is to do, planned before the first torque.

    Attributes:
        approach: from the pose in which the arm rests to the start of the excitation.
        excitation: the reference.
        retreat: back to where it rested.
    """

    approach: Reference
    excitation: Reference
    retreat: Reference


def plan(arm: Arm, rest: Array, excitation: Reference) -> Motion:
    """The motion from and to a resting pose, shape (n,) [rad].

    Raises:
        RefusalError: the way there breaks a limit.
    """
    file, period_s = arm.file, arm.file.bus.period_s
    approach = move(arm.robot, file.limits, rest, excitation.q[0], period_s)
    retreat = move(arm.robot, file.limits, excitation.q[-1], rest, period_s)
    shapes = collision_shapes(arm.robot)
    faults = [
        sentence
        for quantity in quantities(file, file.limits, arm.robot, shapes, approach)
        for sentence in violations(quantity, approach.t)
    ]
    if faults:
        raise RefusalError("The move from the resting pose to the start of the excitation", faults)
    return Motion(approach, excitation, retreat)


def check_rest(planned: Array, measured: Array, names: Sequence[str]) -> None:
    """See whether the arm still rests where its motion was planned from, both shape (n,) [rad].

    Raises:
        RefusalError: a joint has moved, or its encoder has.
    """
    faults = _moved(planned, measured, names)
    if faults:
        what = "The motion, which was planned from another pose,"
        raise RefusalError(
            what, [f"{fault}; look at the pose, and begin again" for fault in faults]
        )


def _moved(planned: Array, measured: Array, names: Sequence[str]) -> list[str]:
    labels = numbered_joints(names)
    return [
        f"{labels[k]} stands at {measured[k]:+.3f} rad and stood at "
        f"{planned[k]:+.3f} rad (limit {AT_REST_RAD:g} rad)"
        for k in np.flatnonzero(~(np.abs(measured - planned) <= AT_REST_RAD)).tolist()
    ]


def run(arm: Arm, drives: Drives, loop: Loop, motion: Motion, tests_motors: bool = True) -> int:
    """Enable, approach, excite, return, release, disable; returns the counted cycles logged.

    Before the approach each motor is tested by a motion of less than 0.02 rad, unless
    `tests_motors` says that it was done. Whatever goes wrong, even a bug, torque is taken away
    before anything else happens.

    Raises:
        StopError: it ended early; the message says why, and what was done.
    """
    loop.heart.begin()
    try:
        return _phases(arm, drives, loop, motion, tests_motors)
    except StopError:
        raise
    except BaseException:
        drives.cut_off()
        raise
    finally:
        loop.heart.rest()


def _phases(arm: Arm, drives: Drives, loop: Loop, motion: Motion, tests_motors: bool) -> int:
    try:
        _enable(drives, loop)
        _check_start(loop, motion, arm.robot.joint_names)
        tested = first_motion(arm, loop) if tests_motors else None
        _follow(arm, loop, Phase.APPROACH, motion.approach)
        if tested is not None:
            second_motion(arm, loop, tested)
        counted = _follow(arm, loop, Phase.EXCITE, motion.excitation)
        _follow(arm, loop, Phase.RETURN, motion.retreat)
        _release(arm, loop)
        _disable(drives, loop, Phase.DISABLE)
        return counted
    except StopError as stop:
        stop.outcome = _end_early(arm, drives, loop, stop)
        raise


def _enable(drives: Drives, loop: Loop) -> None:
    drives.enable()
    for _ in range(loop.cycles(drives.enabling_s)):
        if loop.cycle(_no_torque, CheckLevel.MOTION, Phase.ENABLE).enabled:
            return
    states = [
        f"{name} {drives.state_names.get(state, state)}"
        for name, state in zip(drives.names, drives.states(), strict=True)
    ]
    needs = f", which needs {drives.enabling_needs}" if drives.enabling_needs else ""
    stop = BusStopError(
        f"not all drives were enabled within {drives.enabling_s:g} s ({', '.join(states)}){needs}"
    )
    loop.stamp(stop)
    raise stop


def _check_start(loop: Loop, motion: Motion, names: Sequence[str]) -> None:
    """The arm may have been moved while it waited for its drives."""
    faults = _moved(motion.approach.q[0], loop.state.q, names)
    if faults:
        stop = SafetyStopError(f"the arm has moved before it began: {'; '.join(faults)}", False)
        loop.stamp(stop)
        raise stop


def _follow(arm: Arm, loop: Loop, phase: Phase, reference: Reference) -> int:
    """Track a reference; returns how many of its counted cycles were logged."""
    total, logged = len(reference.t), [0]
    for k in range(total):
        if k % _PROGRESS_CYCLES == 0:
            loop.show(phase, k, total)
        if k in (reference.counted.start, reference.counted.stop):
            logged.append(loop.rows)
        wanted = Setpoint(reference.q[k], reference.qd[k], reference.qdd[k])
        loop.cycle(_towards(arm, wanted), CheckLevel.TRACKING, phase)
    return logged[-1] - logged[-2] if len(logged) > 2 else 0


def _release(arm: Arm, loop: Loop) -> None:
    """Let the arm sink onto whatever carries it: gravity fades out, damping stays."""
    cycles = loop.cycles(_RELEASE_S)
    for k in range(cycles):
        loop.cycle(_sinking(arm, 1.0 - (k + 1) / cycles), CheckLevel.MOTION, Phase.RELEASE)


def _disable(drives: Drives, loop: Loop, phase: Phase) -> bool:
    """Torque zero at once, then the drives off; returns whether all confirmed it."""
    loop.send_zero_torque()
    confirmed = any(
        loop.cycle(_no_torque, CheckLevel.NOTHING, phase).disabled
        for _ in range(loop.cycles(_DISABLE_S))
    )
    if not confirmed:
        drives.cut_off()  # at once, since closing the log takes its time
    return confirmed


def _end_early(arm: Arm, drives: Drives, loop: Loop, stop: StopError) -> str:
    """Brake where readings and drives can be trusted, then disable; returns what was done."""
    done = ""
    try:
        if stop.brakes and loop.phase not in _UNTESTED:
            is_well = isinstance(stop, OutsideStopError)
            done = _brake(arm, loop, is_well)
        confirmed = _disable(drives, loop, Phase.CUT_OFF)
    except StopError as second:
        drives.cut_off()
        return f"{done}the drives were told to cut off, then {second.cause}"
    sure = "were disabled" if confirmed else "were told to disable, and not all confirmed it"
    return f"{done}the drives {sure}"


def _brake(arm: Arm, loop: Loop, is_well: bool) -> str:
    """Brake for as long as braking makes the arm slower; returns what came of it.

    An arm that is well is braked along its reference, so that it holds a load as before; any other
    one from where it is, since its reference may be what pulls it away, and without the motors
    that may be what is wrong.
    """
    if not is_well:
        loop.let_go_of_suspects()
    start, file = loop.wanted if is_well else loop.state, arm.file
    monitor = BrakingMonitor(file, arm.robot, loop.state)
    braking_s = file.safety.braking_s
    reference = brake(start.q, start.qd, braking_s, file.bus.period_s)
    steps = [
        _towards(arm, Setpoint(*step))
        for step in zip(reference.q, reference.qd, reference.qdd, strict=True)
    ]
    try:
        loop.send_instead(steps[0])
        for law in steps:
            loop.cycle(law, CheckLevel.DRIVES, Phase.BRAKE, monitor.check)
    except StopError as second:
        left = monitor.left(loop.state)
        return f"braking was cut short with {left} ({second.cause}) and "
    return f"the arm was braked for {braking_s:g} s with {monitor.left(loop.state)} and "


def _no_torque(state: ArmState) -> tuple[Setpoint, Array]:
    zero = np.zeros_like(state.q)
    return Setpoint(state.q, zero, zero), zero


def _towards(arm: Arm, wanted: Setpoint) -> Law:
    return lambda state: (wanted, arm.control.torque(state.q, state.qd, wanted))


def _sinking(arm: Arm, held: float) -> Law:
    def law(state: ArmState) -> tuple[Setpoint, Array]:
        zero = np.zeros_like(state.q)
        return Setpoint(state.q, zero, zero), arm.control.release(state.q, state.qd, held)

    return law
