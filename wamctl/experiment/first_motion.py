"""The first motion is a small one: each motor in turn to and fro by some milliradians.

It finds motors with the wrong sign, with twice their torque or none, a dead encoder, or each
other's wires before the arm goes anywhere. A healthy arm stays within 0.02 rad.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from wamctl.arm.control import Setpoint
from wamctl.arm.joint_labels import numbered_joints
from wamctl.arm.trajectory_check import expected_friction
from wamctl.errors import SafetyStopError
from wamctl.experiment.loop import Arm, Array, CheckLevel, Loop
from wamctl.safety.held_weight import ANY_SCALE, explanation
from wamctl.safety.motor_response import ResponseRecord, fault, response
from wamctl.safety.state_estimator import ArmState
from wamctl.telemetry.phase import Phase

Envelope = Callable[[float], float]
"""Share of the amplitude, by the share of a period that has passed."""

FREQUENCY_HZ = 5.0
AMPLITUDE_RAD = 0.006
"""Of the joint that a motor moves most; less where the acceleration's limit asks for it."""
UNKNOWN_LOAD = 0.1
"""Share of the moving mass that a tool may have of which the model does not know: it lets the held
arm sag. A joint that goes further than such a tool would make it is not held."""
_TOOL_M = 0.1  # from the tool point to such a tool's centre of mass
_LEAST_SAG_RAD = 0.03
_MOST_SAG = 0.95  # of the tracking limit
_ACCELERATION = 0.8  # share of the joint's limit
_HOLD_S = 0.2
_TURNING_RAD_S = 0.05  # below this speed the expected friction fades out
_FIRST_SHARES = (0.1, 0.4)  # of the expected friction that is fed forward at first
_ATTEMPTS = 7  # each of two periods: one to settle, one to look at
_MOVED = (0.5, 1.8)  # shares of the wanted motion between which it tells sign and scale
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


def first_motion(arm: Arm, loop: Loop) -> None:
    """Hold the arm where it is, then move each motor a little.

    Raises:
        StopError: a motor does not answer as it should, or anything that stops the arm.
    """
    rest = loop.state.q.copy()
    zero, bounds = np.zeros_like(rest), HoldBounds(arm, rest)
    for _ in range(loop.cycles(_HOLD_S)):
        _cycle(arm, loop, bounds, Setpoint(rest, zero, zero), zero, _Samples())
    waves = [_Wave(arm, rest, bounds, motor) for motor in range(len(rest))]
    answers = []
    for motor, wave in enumerate(waves):
        loop.show(Phase.TEST, motor, len(rest))
        answers.append(_test(arm, loop, wave, motor))
    held = np.array([held_nm for held_nm, _ in answers])
    friction = np.array([wave.friction_on_motor_nm for wave in waves])
    tool = arm.file.limits.tool_frame
    found = explanation(arm.robot, arm.transmission, tool, loop.state.q, held, friction)
    cause = found.fault(answers[found.motor][1])
    if cause is not None:
        stop = SafetyStopError(cause)
        loop.stamp(stop)
        raise stop


class HoldBounds:
    """How far and how fast the joints of a held arm may go, whatever tool it carries.

    An arm that gives way to a tool is a critically damped step: x w exp(-w t) t at the distance x
    and the bandwidth w, at most x w / e. A motor with the wrong sign grows beyond that long before
    it has gone far.

    Attributes:
        furthest: from the reference, shape (n,) [rad].
        fastest: shape (n,) [rad/s]; the small motion itself is in it.
    """

    def __init__(self, arm: Arm, q: Array) -> None:
        self.furthest = sag_limit(arm, q)
        falling = self.furthest * np.sqrt(arm.control.stiffness) / math.e
        own = _MOVED[1] * AMPLITUDE_RAD * 2.0 * math.pi * FREQUENCY_HZ
        self.fastest = falling + own


def sag_limit(arm: Arm, q: Array) -> Array:
    """How far each joint may go from where it is held, shape (n,) [rad].

    Args:
        arm: model, control law and tracking limits.
        q: the pose, shape (n,) [rad].
    """
    model, data = arm.robot.model, arm.robot.data()
    tool = model.getFrameId(arm.file.limits.tool_frame)
    lever = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED)
    weight = UNKNOWN_LOAD * pin.computeTotalMass(model) * np.linalg.norm(model.gravity.linear)
    torque = weight * (np.linalg.norm(lever[:3], axis=0) + _TOOL_M)
    stiffness = np.diag(pin.crba(model, data, q)) * arm.control.stiffness
    most = _MOST_SAG * np.array(arm.file.safety.tracking_error_rad)
    return np.minimum(_LEAST_SAG_RAD + torque / stiffness, most)


def _test(arm: Arm, loop: Loop, wave: "_Wave", motor: int) -> tuple[float, tuple[float, float]]:
    """Move one motor, with as much torque against friction as it needs, and judge its answer.

    Returns its mean torque meanwhile [N m], motor side, and the scale that its motion shows: any
    where friction hides it.
    """
    rotors = np.array(arm.file.transmission.rotor_inertia_kg_m2)
    share, low, high, found, held_nm = wave.first_share, 0.0, math.inf, None, 0.0
    for k in range(_ATTEMPTS):
        _period(arm, loop, wave, share, _steady if k else _fade_in)
        samples = _period(arm, loop, wave, share, _steady)
        record = samples.record(wave.rate)
        found = response(arm.robot, arm.transmission, rotors, record, motor)
        held_nm = float((record.tau.mean(axis=0) @ arm.transmission.joint_from_motor)[motor])
        if _MOVED[0] <= found.motion <= _MOVED[1]:
            break
        low, high = (share, high) if found.motion < _MOVED[0] else (low, share)
        share = min(2.0 * share, (low + high) / 2.0)
    _period(arm, loop, wave, share, _fade_out)
    cause = fault(found, motor, wave.least_torque_nm) if found is not None else None
    if cause is not None:
        stop = SafetyStopError(cause, brakes=False)
        loop.stamp(stop)
        raise stop
    if found is None or found.torque_nm <= wave.least_torque_nm:
        return held_nm, ANY_SCALE
    return held_nm, found.scale


class _Wave:
    """The small motion of one motor, and the friction that it may meet.

    Attributes:
        rate: angular frequency [rad/s].
        bounds: how far and how fast the joints may go.
        first_share: of the expected friction that is fed forward at first: little where friction
            is much more than inertia.
        friction: Coulomb friction to expect at the joints, shape (n,) [N m].
        friction_on_motor_nm: of those joints, felt by the motor [N m].
        least_torque_nm: torque of the motor below which friction hides its scale [N m].
    """

    def __init__(self, arm: Arm, rest: Array, bounds: HoldBounds, motor: int) -> None:
        self.bounds = bounds
        self.rate = 2.0 * math.pi * FREQUENCY_HZ
        self._rest, self._shape = rest, _direction(arm, motor, self.rate)
        joints, limits = arm.transmission, arm.file.limits
        expected = expected_friction(arm.file)[1]
        unknown = _UNKNOWN * np.abs(joints.motor_from_joint).T @ np.array(limits.motor_torque_nm)
        self.friction = np.where(expected > 0.0, expected, unknown)
        inertia = np.diag(pin.crba(arm.robot.model, arm.robot.data(), rest))
        driven = np.abs(self._shape) * inertia * self.rate**2
        enough = driven.sum() / (2.0 * self.friction[self._shape != 0.0].sum())
        self.first_share = float(np.clip(enough, *_FIRST_SHARES))
        on_motors = np.abs(joints.joint_from_motor).T @ self.friction
        self.friction_on_motor_nm = float(on_motors[motor])
        self.least_torque_nm = _HIDDEN * self.friction_on_motor_nm

    def at(self, phase: float, share: float) -> Setpoint:
        """The reference, of a share of the whole amplitude."""
        sine, cosine = share * math.sin(phase), share * math.cos(phase)
        return Setpoint(
            self._rest + sine * self._shape,
            self.rate * cosine * self._shape,
            -(self.rate**2) * sine * self._shape,
        )


def _period(arm: Arm, loop: Loop, wave: _Wave, share: float, envelope: Envelope) -> _Samples:
    """One period of the motion, with a share of the expected friction fed forward."""
    samples, cycles = _Samples(), loop.cycles(1.0 / FREQUENCY_HZ)
    for k in range(1, cycles + 1):
        phase = 2.0 * math.pi * k / cycles
        wanted = wave.at(phase, envelope(k / cycles))
        friction = share * wave.friction * np.tanh(wanted.qd / _TURNING_RAD_S)
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

    def check(state: ArmState) -> None:
        away, speed = np.abs(state.q - wanted.q), np.abs(state.qd)
        for value, most, did, unit in (
            (away, bounds.furthest, "went {:.3f} rad away", "rad"),
            (speed, bounds.fastest, "moved at {:.3f} rad/s", "rad/s"),
        ):
            if np.count_nonzero(value > most):
                k = int(np.argmax(value / most))
                raise SafetyStopError(
                    f"{numbered_joints(arm.robot.joint_names)[k]} {did.format(value[k])} while it "
                    f"was held (limit {most[k]:.3f} {unit}): look at signs, ratios and assignment "
                    "of its motors, and at the load",
                    brakes=False,
                )

    loop.cycle(law, CheckLevel.MOTION, Phase.TEST, check)


def _direction(arm: Arm, motor: int, rate_rad_s: float) -> Array:
    """Joint motion that turns one motor alone, shape (n,) [rad]."""
    shape = arm.transmission.joint_from_motor[:, motor].copy()
    shape *= AMPLITUDE_RAD / np.abs(shape).max()
    most = _ACCELERATION * np.array(arm.file.limits.acceleration_rad_s2) / rate_rad_s**2
    return shape * min(1.0, float((most / np.maximum(np.abs(shape), 1e-12)).min()))
