"""Play in the transmission."""

from dataclasses import replace

import numpy as np
from numba import njit

from ident.effects.effect import (
    ArmFacts,
    Array,
    Coefficient,
    Freedom,
    Hypothesis,
    Observed,
    Setting,
)
from ident.effects.slope import rates
from ident.simulation.arm import SimulatedArm
from ident.simulation.chain import Chain, inverse_dynamics, mass_matrix, workspace

_SUBSTEPS = 5
_TURNED = 0.005  # rad/s: the motor's friction has turned round
_LIGHT = 1e-6  # kg m^2: no link is lighter
_MOTOR = 0.1  # of the joint's inertia: a motor's, at first
_MOST = 0.9  # of the inertia that a joint feels while the others are free: the link has some too


@njit(cache=True)
def loose(q, qd, pull, drag, start, half_play, period):
    """Way of a link beside its motor's, and friction that it has beside what it would have there.

    Between its stops, +- half_play [rad] from the motor, the link moves freely; at a stop it is
    carried, without rebound, for as long as that pushes.

    Args:
        q: position of the motor on the joint's side, shape (S,).
        qd: its velocity, shape (S,).
        pull: acceleration of the link where nothing touches it, but for its friction, shape (S,).
        drag: deceleration by its dry friction, and per speed by its viscous one, shape (2, S).
        start: of the link beside the motor [rad].
        half_play: [rad].
        period: between samples [s].

    Returns:
        position of the link less the motor's [rad], and deceleration by friction less that of a
        link that moves with the motor [rad/s^2], each of shape (S,).
    """
    beside, rubbed = np.empty(q.size), np.zeros(q.size)
    h = period / _SUBSTEPS
    speed = qd[0]
    link = q[0] + start
    beside[0] = start
    for k in range(1, q.size):
        for step in range(1, _SUBSTEPS + 1):
            u = step / _SUBSTEPS
            motor = (1.0 + 2.0 * u) * (1.0 - u) ** 2 * q[k - 1] + u * u * (3.0 - 2.0 * u) * q[k]
            motor += period * (u * (1.0 - u) ** 2 * qd[k - 1] - u * u * (1.0 - u) * qd[k])
            free = speed + h * ((1.0 - u) * pull[k - 1] + u * pull[k])
            rub = h * drag[0, k]
            slowed = max(free - rub, 0.0) if free > 0.0 else min(free + rub, 0.0)
            slowed /= 1.0 + h * drag[1, k]
            ahead = min(max(link + h * slowed, motor - half_play), motor + half_play)
            speed = (ahead - link) / h
            if ahead == link + h * slowed:
                along = (1.0 - u) * qd[k - 1] + u * qd[k]
                with_motor = drag[0, k] * min(max(along / _TURNED, -1.0), 1.0) + drag[1, k] * along
                rubbed[k] += ((free - slowed) / h - with_motor) / _SUBSTEPS
            link = ahead
        beside[k] = link - q[k]
    return beside, rubbed


class Backlash:
    """q_link = q_motor + y, |y| <= b, free in between."""

    id = "backlash"
    title = "play in the transmission"
    equation = "q_link,j = q_j + y, |y| <= b; tau_link,j = 0 for |y| < b, else it pushes"
    source = "Nordin, Gutman 2002, section 2: dead zone, rigid contact on both sides, no rebound"
    signature = (
        "no torque while the link crosses the play, a blow at its end, where the transmitted "
        "torque, not the speed, changes its sign"
    )
    rivals = ("presliding", "encoder_offset")
    contains = ()
    experiment = "torque that changes sign without a change of speed, as through a gravity crossing"
    compares = False
    freedom = Freedom.ANY
    smooth = True
    uses = ("model", "friction", "torque")
    twice = ("half_play", "play")
    settings = (
        Setting("play", "rad", (5e-4, 1e-3, 2e-3, 4e-3, 8e-3), 2e-4, 0.03, reported=False),
        Setting("rubbing", "1", (0.0, 0.25, 0.5, 0.75, 1.0), 0.0, 1.0, even=True, reported=False),
        Setting("motor_inertia", "kg m^2", (1e-3, 4e-3), 1e-7, 10.0, late=True, reported=False),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint, half play and part of the friction that is rubbed by the link."""
        rows, mass = tuple(range(arm.dof)), np.diag(_mass(arm.chain, arm.delta, arm.pose))
        half = (Coefficient("half_play", "rad", lower=0.0),)
        motor = np.maximum(_MOTOR * mass, _LIGHT)
        play, rubbing, inertia = self.settings
        return [
            Hypothesis(
                self.id,
                (j,),
                rows,
                half,
                {play.name: b, rubbing.name: part, inertia.name: float(motor[j])},
            )
            for j in arm.moving_joints
            for part in rubbing.grid
            for b in play.grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the link's motion in the play, per half play."""
        j, shape = hypothesis.joints[0], hypothesis.settings
        half_play, part, motor = shape["play"], shape["rubbing"], shape["motor_inertia"]
        slopes = seen.slopes(j)
        inertia = np.maximum(slopes.acceleration[:, j] - motor, _LIGHT)
        pull = seen.qdd[:, j] - (seen.load[:, j] - motor * seen.qdd[:, j]) / inertia
        friction = part * np.maximum([[seen.coulomb[j]], [seen.viscous[j]]], 0.0)
        carried = (1.0 - part) * seen.load[0, j] + part * seen.tau[0, j]
        q, qd = np.ascontiguousarray(seen.q[:, j]), np.ascontiguousarray(seen.qd[:, j])
        start = -np.copysign(half_play, carried)
        period = 1.0 / seen.rate_hz
        beside, rubbed = loose(q, qd, pull, friction / inertia, start, half_play, period)
        rate, change = rates(beside, period)
        torque = slopes.times(beside, rate, change)
        torque[:, j] += inertia * rubbed - motor * change
        return torque[:, :, None] / half_play

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A motor of its own, with the encoder, that carries the joint within the play."""
        j, shape = hypothesis.joints[0], hypothesis.settings
        slack, motor, armature = arm.slack.copy(), arm.motor.copy(), arm.armature.copy()
        rubbing = arm.rubbing.copy()
        slack[j] += values[0]
        rubbing[j] = shape["rubbing"]
        without_others = 1.0 / np.linalg.inv(_mass(arm.chain, arm.delta, np.zeros(len(slack))))
        motor[j] = min(shape["motor_inertia"], _MOST * float(without_others[j, j]))
        armature[j, j] -= motor[j]
        return replace(arm, slack=slack, rubbing=rubbing, motor=motor, armature=armature)


def _mass(chain: Chain, delta: Array, q: Array) -> Array:
    """Mass matrix in a pose, shape (n, n)."""
    n = len(delta) // 10
    rest, w, mass = np.zeros(n), workspace(n), np.empty((n, n))
    inverse_dynamics(chain, delta, q, rest, rest, w, np.empty(n))
    mass_matrix(chain, delta, w, mass)
    return mass


EFFECT = Backlash()
