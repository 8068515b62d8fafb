"""A link beside its motor: how it moves where the transmission between them is loose or gives."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ident.dynamics.compiled_chain import Chain, inverse_dynamics, mass_matrix, workspace
from ident.dynamics.derivatives import rates
from ident.effects.candidate import Candidate, P
from ident.effects.effect import Array, Effect
from ident.effects.observation import Observed
from ident.simulation.arm import SimulatedArm
from wamctl.arm.compilation import compiled

_SUBSTEPS = 5
_TURNED = 0.005  # rad/s: the motor's friction has turned round
MIN_INERTIA = 1e-6
"""No link or motor is lighter [kg m^2]."""


@dataclass(frozen=True)
class Transmission:
    """What ties a link to its motor.

    Attributes:
        half_play: half the way to its stops [rad]; infinite: there are none.
        compliance: of what pulls it back to the motor [rad/(N m)]; 0: nothing does.
        damped: damping of that, as a part of the critical one.
        rubbing: part of the joint's friction that the link rubs, not the motor.
        motor_inertia: on the joint's side [kg m^2].
    """

    half_play: float
    compliance: float
    damped: float
    rubbing: float
    motor_inertia: float

    def torque_change(self, seen: Observed, joint: int) -> Array:
        """What the link's motion beside its motor changes in the joints' torque, shape (S, n)."""
        j, slopes = joint, seen.slopes(joint)
        load = seen.load[:, j] + seen.carried[:, j]
        start = self.compliance * load[0]
        if self.compliance == 0.0:
            start = (1.0 - self.rubbing) * load[0] + self.rubbing * seen.tau[0, j]
            start = np.copysign(self.half_play, start)
        dry, viscous = (self.rubbing * max(x[j], 0.0) for x in (seen.coulomb, seen.viscous))
        motion = tuple(np.ascontiguousarray(x[:, j]) for x in (seen.q, seen.qd, seen.qdd))
        by_motion = slopes.position, slopes.velocity, slopes.acceleration
        tie = self.compliance, self.damped, self.half_play, self.motor_inertia
        period = 1.0 / seen.rate_hz
        return _change(motion, load, by_motion, j, (dry, viscous), tie, -start, period)

    def static_change(self, seen: Observed, joint: int) -> Array:
        """The same from each sample alone: hung by its load, or at the end of its play."""
        load = seen.load[:, joint] + seen.carried[:, joint]
        beside = -self.compliance * load
        if self.compliance == 0.0:
            pushed = (1.0 - self.rubbing) * load + self.rubbing * seen.tau[:, joint]
            beside = -self.half_play * np.sign(pushed)
        return seen.slopes(joint).position * beside[:, None]

    def insert_motor(self, arm: SimulatedArm, joint: int) -> SimulatedArm:
        """The arm whose joint has a motor of its own, with the encoder, tied to it so."""
        motor, backlash, compliance = arm.motor.copy(), arm.backlash.copy(), arm.compliance.copy()
        damping, link_share = arm.damping.copy(), arm.link_friction_share.copy()
        motor[joint] = max(self.motor_inertia, MIN_INERTIA)
        if self.half_play < np.inf:
            backlash[joint] += self.half_play
        mass = mass_in(np.zeros(len(arm.motor)), arm.chain, arm.delta) + arm.armature
        link = max(float(mass[joint, joint]) - self.motor_inertia, MIN_INERTIA)
        compliance[joint] += self.compliance
        damping[joint] += 2.0 * self.damped * np.sqrt(self.compliance * link)
        link_share[joint] = self.rubbing
        return replace(
            arm,
            motor=motor,
            backlash=backlash,
            compliance=compliance,
            damping=damping,
            link_friction_share=link_share,
        )


class MotorLink(Effect[P]):
    """An effect whose link moves beside its motor; its size is its only coefficient.

    The first of its parameters is the size about which its columns are formed.
    """

    band_limited = True
    has_memory = True

    @abstractmethod
    def tie(self, parameters: P, size: float) -> Transmission:
        """What ties the link to its motor, for a size."""

    def columns(self, seen: Observed, candidate: Candidate[P]) -> Array:
        """Change of the torque with the link's motion beside its motor, per unit of the size."""
        tie, size = self._formed(candidate)
        return tie.torque_change(seen, candidate.joints[0])[:, :, None] / size

    def static_columns(self, seen: Observed, candidate: Candidate[P]) -> Array:
        """The same where the link rests beside its motor."""
        tie, size = self._formed(candidate)
        return tie.static_change(seen, candidate.joints[0])[:, :, None] / size

    def _formed(self, candidate: Candidate[P]) -> tuple[Transmission, float]:
        shape: Any = candidate.parameters
        return self.tie(shape, shape[0]), shape[0]

    def simulated(self, arm: SimulatedArm, candidate: Candidate[P], values: Array) -> SimulatedArm:
        """A motor of its own, with the encoder, tied to the joint."""
        tie = self.tie(candidate.parameters, float(values[0]))
        return tie.insert_motor(arm, candidate.joints[0])


@compiled
def _change(motion, load, slopes, joint, friction, tie, start, period):
    """Change of the joints' torque, shape (S, n), where a link moves beside its motor.

    Args:
        motion: the motor's position, velocity and acceleration on the joint's side, each (S,).
        load: torque that the link needs where it moves with the motor [N m], shape (S,).
        slopes: of all joints' torque by that motion of this joint, each of shape (S, n).
        joint: from 0.
        friction: dry [N m] and viscous [N m s/rad] friction of the link.
        tie: compliance, damping, half play and motor's inertia, as of `Transmission`.
        start: of the link beside the motor [rad].
        period: between samples [s].
    """
    (q, qd, qdd), (by_place, by_rate, by_change) = motion, slopes
    compliance, damped, half_play, motor = tie
    samples, n = by_place.shape
    inertia, pull, grip = np.empty(samples), np.empty(samples), np.zeros(samples)
    drag = np.empty((2, samples))
    for k in range(samples):
        inertia[k] = max(by_change[k, joint] - motor, MIN_INERTIA)
        pull[k] = qdd[k] - (load[k] - motor * qdd[k]) / inertia[k]
        drag[0, k], drag[1, k] = friction[0] / inertia[k], friction[1] / inertia[k]
        if compliance > 0.0:
            grip[k] = 1.0 / (compliance * inertia[k])
    beside, rubbed = integrate_link_motion(
        (q, qd), pull, drag, (grip, damped), start, half_play, period
    )
    rate, change = rates(beside, period)
    torque = np.empty((samples, n))
    for k in range(samples):
        for i in range(n):
            moved = by_place[k, i] * beside[k] + by_rate[k, i] * rate[k]
            torque[k, i] = moved + by_change[k, i] * change[k]
        torque[k, joint] += inertia[k] * rubbed[k] - motor * change[k]
    return torque


@compiled
def integrate_link_motion(motor, pull, drag, spring, start, half_play, period):
    """Way of a link beside its motor's, and friction that it has beside what it would have there.

    Between its stops, +- half_play [rad] from the motor, the link moves freely, or is pulled back
    to the motor by a spring; at a stop it is carried, without rebound, for as long as that pushes.

    Args:
        motor: its position and velocity on the joint's side, each of shape (S,).
        pull: acceleration of the link where nothing touches it, but for its friction, shape (S,).
        drag: deceleration by its dry friction, and per speed by its viscous one, shape (2, S).
        spring: acceleration back to the motor per distance [1/s^2], shape (S,), and its damping as
            a part of the critical one.
        start: of the link beside the motor [rad].
        half_play: [rad].
        period: between samples [s].

    Returns:
        position of the link less the motor's [rad], and deceleration by friction less that of a
        link that moves with the motor [rad/s^2], each of shape (S,).
    """
    (q, qd), (grip, damped) = motor, spring
    beside, rubbed = np.empty(q.size), np.zeros(q.size)
    h = period / _SUBSTEPS
    speed = qd[0]
    link = q[0] + start
    beside[0] = start
    for k in range(1, q.size):
        for step in range(1, _SUBSTEPS + 1):
            u = step / _SUBSTEPS
            place = (1.0 + 2.0 * u) * (1.0 - u) ** 2 * q[k - 1] + u * u * (3.0 - 2.0 * u) * q[k]
            place += period * (u * (1.0 - u) ** 2 * qd[k - 1] - u * u * (1.0 - u) * qd[k])
            free = speed + h * ((1.0 - u) * pull[k - 1] + u * pull[k])
            along = (1.0 - u) * qd[k - 1] + u * qd[k]
            damping = 2.0 * damped * np.sqrt(grip[k])
            free += h * (grip[k] * (place - link) + damping * along)
            rub = h * drag[0, k]
            slowed = max(free - rub, 0.0) if free > 0.0 else min(free + rub, 0.0)
            slowed /= 1.0 + h * (drag[1, k] + damping + h * grip[k])
            ahead = min(max(link + h * slowed, place - half_play), place + half_play)
            speed = (ahead - link) / h
            if ahead == link + h * slowed:
                slower = (free - slowed) / h - (damping + h * grip[k]) * slowed
                with_motor = drag[0, k] * min(max(along / _TURNED, -1.0), 1.0) + drag[1, k] * along
                rubbed[k] += (slower - with_motor) / _SUBSTEPS
            link = ahead
        beside[k] = link - q[k]
    return beside, rubbed


def mass_in(pose: Array, chain: Chain, delta: Array) -> Array:
    """Mass matrix in a pose, shape (n, n)."""
    n = len(delta) // 10
    rest, w, mass = np.zeros(n), workspace(n), np.empty((n, n))
    inverse_dynamics(chain, delta, pose, rest, rest, w, np.empty(n))
    mass_matrix(chain, delta, w, mass)
    return mass
