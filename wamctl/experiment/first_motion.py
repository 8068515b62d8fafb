"""The first motion is a small one: each motor in turn to and fro by some milliradians.

It finds motors with the wrong sign, with twice their torque or none, a dead encoder, or each
other's wires before the arm goes anywhere. A healthy arm stays within 0.02 rad.
"""

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from wamctl.arm.control import Setpoint
from wamctl.arm.joint_labels import numbered_joints
from wamctl.arm.trajectory_check import expected_friction
from wamctl.errors import SafetyStopError
from wamctl.experiment.hold_bounds import HoldBounds
from wamctl.experiment.loop import Arm, Array, CheckLevel, Loop
from wamctl.safety.held_weight import explanation
from wamctl.safety.motor_response import (
    ANY_SCALE,
    Response,
    ResponseRecord,
    motion_fault,
    response,
    scale_fault,
    shown_scale,
)
from wamctl.safety.state_estimator import ArmState
from wamctl.telemetry.status import Phase

Envelope = Callable[[float], float]
"""Share of the amplitude, by the share of a period that has passed."""

FREQUENCY_HZ = 5.0
AMPLITUDE_RAD = 0.006
"""Of the joint that a motor moves most; less where the acceleration's limit asks for it."""
_SLOWER = 0.5  # share of the frequency at which a scale that looks wrong is looked at again
_ACCELERATION = 0.8  # share of the joint's limit
_HOLD_S = 0.2
_BEYOND = 1.25  # amplitudes from where a joint that broke away is not helped against friction
_MOST_SHARE = 4.0  # of the expected friction that is fed forward at most
_TURNING_RAD_S = 0.05  # below this speed the expected friction fades out
_FIRST_SHARES = (0.1, 0.4)  # of the expected friction that is fed forward at first
_ATTEMPTS = 7  # each of two periods: one to settle, one to look at
_MOVED = (0.5, 1.8)  # shares of the wanted motion between which it tells sign and scale
_AS_FAR = (0.8, 1.2)  # shares of a way between which another motion has gone it, too
_MOST_RAD_S = _MOVED[1] * AMPLITUDE_RAD * 2.0 * math.pi * FREQUENCY_HZ
_UNKNOWN = 0.05  # share of the torque limit taken for friction that nobody has told
_HIDDEN = 0.3  # share of the expected friction below which a torque's scale is not judged


def _fade_in(share: float) -> float:
    return math.sin(math.pi / 2.0 * share) ** 2


def _fade_out(share: float) -> float:
    return 1.0 - _fade_in(share)


def _steady(share: float) -> float:
    return 1.0


@dataclass
class _Samples:
    """What was measured while one motor moves."""

    phase: list[float] = field(default_factory=list)
    q_ref: list[Array] = field(default_factory=list)
    q: list[Array] = field(default_factory=list)
    tau: list[Array] = field(default_factory=list)

    def record(self, rate_rad_s: float) -> ResponseRecord:
        """The samples; torque is the mean of those before and behind each of them."""
        tau = np.array(self.tau)
        around = (tau + np.roll(tau, -1, axis=0)) / 2.0
        phase, q_ref, q = (np.array(values) for values in (self.phase, self.q_ref, self.q))
        return ResponseRecord(phase, q_ref, q, around, rate_rad_s)


@dataclass(frozen=True)
class TestedMotors:
    """What the small motion of each motor showed.

    Attributes:
        q: the pose, shape (n,) [rad].
        held: mean torque of each motor, motor side; not a number where friction held it, shape
            (n,) [N m].
        scales: lowest and highest scale of each motor that its motion shows.
        shares: of the expected friction that each motor needed, shape (n,).
    """

    q: Array
    held: Array
    scales: tuple[tuple[float, float], ...]
    shares: Array


def first_motion(arm: Arm, loop: Loop) -> TestedMotors:
    """Hold the arm where it is, then move each motor a little.

    Raises:
        StopError: a motor does not answer as it should, or anything that stops the arm.
    """
    rest = loop.state.q.copy()
    zero, bounds = np.zeros_like(rest), HoldBounds(arm, rest, _MOST_RAD_S, Phase.TEST)
    for _ in range(loop.cycles(_HOLD_S)):
        _cycle(arm, loop, bounds, Setpoint(rest, zero, zero), zero, _Samples())
    held, shares, scales = np.zeros_like(rest), np.zeros_like(rest), []
    for motor in range(len(rest)):
        loop.show(Phase.TEST, motor, len(rest))
        answer, scale = _test(arm, loop, _Wave(arm, rest, loop.state.q, bounds, motor), motor)
        held[motor], shares[motor] = answer.response.held_nm, answer.share
        scales.append(scale)
    tested = TestedMotors(loop.state.q.copy(), held, tuple(scales), shares)
    _weigh(arm, loop, [tested.q], [held], tested)
    return tested


def second_motion(arm: Arm, loop: Loop, tested: TestedMotors) -> None:
    """Move those motors a little that hold more than friction where the arm has come to.

    What a tool would explain in one pose it does not explain in two.

    Raises:
        StopError: the weight in both poses shows a wrong scale, or anything that stops the arm.
    """
    there = loop.wanted.q
    bounds = HoldBounds(arm, there, _MOST_RAD_S, Phase.APPROACH, loop.state.q - there)
    weight = pin.computeGeneralizedGravity(arm.robot.model, arm.robot.data(), there)
    on_motor, held = arm.transmission.joint_from_motor.T @ weight, np.full_like(there, np.nan)
    for motor in range(len(there)):
        wave = _Wave(arm, there, loop.state.q, bounds, motor)
        if abs(on_motor[motor]) > wave.friction_on_motor_nm:
            wave.first_share = tested.shares[motor]
            held[motor] = _answer(arm, loop, wave, motor).response.held_nm
    _weigh(arm, loop, [tested.q, loop.state.q], [tested.held, held], tested)


def _weigh(
    arm: Arm, loop: Loop, poses: list[Array], held: list[Array], tested: TestedMotors
) -> None:
    friction = np.abs(arm.transmission.joint_from_motor).T @ _friction(arm)
    tool = arm.file.limits.tool_frame
    found = explanation(
        arm.robot, arm.transmission, tool, np.array(poses), np.array(held), friction
    )
    cause = found.fault(tested.scales[found.motor])
    if cause is not None:
        stop = SafetyStopError(cause)
        loop.stamp(stop)
        raise stop


def _friction(arm: Arm) -> Array:
    """Coulomb friction that the joints may have, shape (n,) [N m]."""
    limit, expected = np.array(arm.file.limits.motor_torque_nm), expected_friction(arm.file)[1]
    unknown = _UNKNOWN * np.abs(arm.transmission.motor_from_joint).T @ limit
    return np.where(expected > 0.0, expected, unknown)


@dataclass(frozen=True)
class _Answer:
    """What a motor did, with how much torque against friction."""

    response: Response
    share: float


def _test(arm: Arm, loop: Loop, wave: "_Wave", motor: int) -> tuple[_Answer, tuple[float, float]]:
    """Move one motor, and judge its answer.

    Returns it, and the scale that its motion shows: any where friction hides it.
    """
    answer = _answer(arm, loop, wave, motor)
    fast = answer.response
    cause, shown = motion_fault(fast, motor), ANY_SCALE
    if cause is None and abs(fast.needed_nm[0]) > _HIDDEN * wave.friction_on_motor_nm:
        shown = shown_scale(fast)
        if shown == ANY_SCALE or scale_fault(shown, motor) is not None:
            slow = _answer(arm, loop, wave.slower(fast.motion), motor, _AS_FAR).response
            as_far = _AS_FAR[0] <= slow.motion <= _AS_FAR[1]
            cause = scale_fault(shown_scale(fast, slow), motor) if as_far else None
    if cause is not None:
        stop = SafetyStopError(cause, brakes=False)
        loop.stamp(stop)
        raise stop
    return answer, shown


def _answer(
    arm: Arm, loop: Loop, wave: "_Wave", motor: int, wanted: tuple[float, float] = _MOVED
) -> _Answer:
    """Move one motor, with as much torque against friction as it needs: its best attempt."""
    rotors = np.array(arm.file.transmission.rotor_inertia_kg_m2)
    share, low, high = wave.first_share, 0.0, math.inf
    answers: list[_Answer] = []
    for k in range(_ATTEMPTS):
        _period(arm, loop, wave, share, _steady if k else _fade_in)
        record = _period(arm, loop, wave, share, _steady).record(wave.rate)
        found = response(arm.robot, arm.transmission, rotors, record, motor)
        moved = found.motion >= wanted[0] and _went_both_ways(found)
        answers.append(_Answer(found, share))
        if moved and found.motion <= wanted[1]:
            break
        low, high = (low, share) if moved else (share, high)
        share = min(2.0 * share, (low + high) / 2.0, _MOST_SHARE)
    _period(arm, loop, wave, share, _fade_out)
    return min(answers, key=_distance)


def _went_both_ways(found: Response) -> bool:
    """Whether the joints turned round, and did not just give way to what pulls at them."""
    return math.isfinite(found.held_nm)


def _distance(answer: _Answer) -> tuple[bool, float]:
    """How far an answer is from the wanted motion."""
    found = answer.response
    return not _went_both_ways(found), abs(math.log(max(found.motion, 1e-3)))


class _Wave:
    """The small motion of one motor, and the friction that it may meet.

    Attributes:
        rate: angular frequency [rad/s].
        rest: where its reference begins and ends, shape (n,) [rad].
        begins: where the joints then are, which something else may pull at, shape (n,) [rad].
        shape: amplitude of each joint, shape (n,) [rad].
        bounds: how far and how fast the joints may go.
        first_share: of the expected friction that is fed forward at first: little where friction
            is much more than inertia.
        friction: Coulomb friction to expect at the joints, shape (n,) [N m].
        friction_on_motor_nm: of those joints, felt by the motor [N m].
    """

    def __init__(
        self, arm: Arm, rest: Array, begins: Array, bounds: HoldBounds, motor: int
    ) -> None:
        self.bounds, self.begins = bounds, begins
        self.rate = 2.0 * math.pi * FREQUENCY_HZ
        self.rest, self.shape = rest, _direction(arm, motor, self.rate)
        self.friction = _friction(arm)
        inertia = np.diag(pin.crba(arm.robot.model, arm.robot.data(), rest))
        driven = np.abs(self.shape) * inertia * self.rate**2
        enough = driven.sum() / (2.0 * self.friction[self.shape != 0.0].sum())
        self.first_share = float(np.clip(enough, *_FIRST_SHARES))
        on_motors = np.abs(arm.transmission.joint_from_motor).T @ self.friction
        self.friction_on_motor_nm = float(on_motors[motor])

    def slower(self, share: float) -> "_Wave":
        """A share of the way, at a lower rate."""
        wave = copy.copy(self)
        wave.rate, wave.shape = _SLOWER * self.rate, share * self.shape
        return wave

    def at(self, phase: float, share: float) -> Setpoint:
        """The reference, of a share of the whole amplitude."""
        sine, cosine = share * math.sin(phase), share * math.cos(phase)
        return Setpoint(
            self.rest + sine * self.shape,
            self.rate * cosine * self.shape,
            -(self.rate**2) * sine * self.shape,
        )


def _period(arm: Arm, loop: Loop, wave: _Wave, share: float, envelope: Envelope) -> _Samples:
    """One period of the motion, with a share of the expected friction fed forward."""
    samples, cycles = _Samples(), loop.cycles(2.0 * math.pi / wave.rate)
    helped, side = np.ones(len(wave.shape), dtype=bool), np.zeros_like(wave.shape)
    for k in range(1, cycles + 1):
        phase = 2.0 * math.pi * k / cycles
        wanted = wave.at(phase, envelope(k / cycles))
        # a joint that broke away from friction that falls steeply with speed would run off
        helped |= np.sign(wanted.qd) != side
        side = np.sign(wanted.qd)
        helped &= (loop.state.q - wave.begins) * side <= _BEYOND * np.abs(wave.shape)
        friction = share * wave.friction * np.tanh(wanted.qd / _TURNING_RAD_S) * helped
        samples.phase.append(phase)
        _cycle(arm, loop, wave.bounds, wanted, friction, samples)
    return samples


def _cycle(
    arm: Arm, loop: Loop, bounds: HoldBounds, wanted: Setpoint, friction: Array, samples: _Samples
) -> None:
    def law(state: ArmState) -> tuple[Setpoint, Array]:
        samples.q_ref.append(wanted.q)
        samples.q.append(state.q)
        samples.tau.append(loop.acting)
        return wanted, arm.control.torque(state.q, state.qd, wanted) + friction

    names = numbered_joints(arm.robot.joint_names)
    loop.cycle(law, CheckLevel.MOTION, bounds.phase, lambda s: bounds.check(s, wanted.q, names))


def _direction(arm: Arm, motor: int, rate_rad_s: float) -> Array:
    """Joint motion that turns one motor alone, shape (n,) [rad]."""
    shape = arm.transmission.joint_from_motor[:, motor].copy()
    shape *= AMPLITUDE_RAD / np.abs(shape).max()
    most = _ACCELERATION * np.array(arm.file.limits.acceleration_rad_s2) / rate_rad_s**2
    return shape * min(1.0, float((most / np.maximum(np.abs(shape), 1e-12)).min()))
