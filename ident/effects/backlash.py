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
from ident.simulation.arm import SimulatedArm
from ident.simulation.chain import Chain, inverse_dynamics, mass_matrix, workspace

_FORMS = ("friction on the motor", "friction on the link")
_SUBSTEPS = 5
_LIGHT = 1e-6  # kg m^2: no link is lighter
_MOST = 0.9  # of the inertia that a joint feels while the others are free: the link has some too


@njit(cache=True)
def loose(q, qd, pull, drag, start, half_play, period):
    """Position of a link beside its motor's, shape (S,), within a play of +- half_play [rad].

    Between its stops the link moves freely; at a stop it is carried, without rebound, for as long
    as that pushes.

    Args:
        q: position of the motor on the joint's side, shape (S,).
        qd: its velocity, shape (S,).
        pull: acceleration of the link where nothing touches it, but for its friction, shape (S,).
        drag: deceleration by its dry friction, and per speed by its viscous one, shape (2, S).
        start: of the link beside the motor [rad].
        half_play: [rad].
        period: between samples [s].
    """
    beside = np.empty(q.size)
    h = period / _SUBSTEPS
    speed = qd[0]
    link = q[0] + start
    beside[0] = start
    for k in range(1, q.size):
        for step in range(1, _SUBSTEPS + 1):
            u = step / _SUBSTEPS
            motor = (1.0 + 2.0 * u) * (1.0 - u) ** 2 * q[k - 1] + u * u * (3.0 - 2.0 * u) * q[k]
            motor += period * (u * (1.0 - u) ** 2 * qd[k - 1] - u * u * (1.0 - u) * qd[k])
            speed += h * ((1.0 - u) * pull[k - 1] + u * pull[k])
            rub = h * drag[0, k]
            speed = max(speed - rub, 0.0) if speed > 0.0 else min(speed + rub, 0.0)
            speed /= 1.0 + h * drag[1, k]
            ahead = min(max(link + h * speed, motor - half_play), motor + half_play)
            speed = (ahead - link) / h
            link = ahead
        beside[k] = link - q[k]
    return beside


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
    settings = (
        Setting("play", "rad", (5e-4, 1e-3, 2e-3, 4e-3, 8e-3), 2e-4, 0.03, reported=False),
        Setting("motor_share", "1", (0.1, 0.4), 2e-3, 0.7, late=True, reported=False),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint, half play and side of the friction; every joint's torque changes."""
        rows = tuple(range(arm.dof))
        half = (Coefficient("half_play", "rad", lower=0.0),)
        play, share = self.settings
        return [
            Hypothesis(self.id, (j,), rows, half, {play.name: b, share.name: share.grid[0]}, form)
            for j in arm.moving_joints
            for form in _FORMS
            for b in play.grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the link's motion in the play, per half play."""
        j, half_play = hypothesis.joints[0], hypothesis.settings["play"]
        slopes, whole = seen.slopes(j), seen.slopes(j).acceleration[:, j]
        motor = _motor(_mass(seen.arm.chain, seen.arm.delta), hypothesis)
        inertia = np.maximum(whole - motor, _LIGHT)
        pull = seen.qdd[:, j] - (seen.load[:, j] - motor * seen.qdd[:, j]) / inertia
        friction, carried = np.zeros((2, 1)), seen.load
        if hypothesis.variant == _FORMS[1]:
            friction = np.maximum([[seen.coulomb[j]], [seen.viscous[j]]], 0.0)
            carried = seen.tau
        q, qd = np.ascontiguousarray(seen.q[:, j]), np.ascontiguousarray(seen.qd[:, j])
        start = -np.copysign(half_play, carried[0, j])
        period = 1.0 / seen.rate_hz
        beside = loose(q, qd, pull, friction / inertia, start, half_play, period)
        rate = np.gradient(beside, period)
        change = np.gradient(rate, period)
        torque = slopes.times(beside, rate, change)
        torque[:, j] -= motor * change
        return torque[:, :, None] / half_play

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A motor of its own, with encoder and friction, that carries the joint within the play."""
        j = hypothesis.joints[0]
        slack, motor, armature = arm.slack.copy(), arm.motor.copy(), arm.armature.copy()
        slack[j] += values[0]
        mass = _mass(arm.chain, arm.delta)
        without_others = float(1.0 / np.linalg.inv(mass)[j, j])
        motor[j] = min(_motor(mass, hypothesis), _MOST * without_others)
        armature[j, j] -= motor[j]
        return replace(arm, slack=slack, motor=motor, armature=armature)


def _motor(mass: Array, hypothesis: Hypothesis) -> float:
    """The motor's part of the joint's inertia in the zero pose, on the joint's side [kg m^2]."""
    joint = hypothesis.joints[0]
    return hypothesis.settings["motor_share"] * float(mass[joint, joint])


def _mass(chain: Chain, delta: Array) -> Array:
    """Mass matrix in the zero pose, shape (n, n)."""
    n = len(delta) // 10
    rest, w, mass = np.zeros(n), workspace(n), np.empty((n, n))
    inverse_dynamics(chain, delta, rest, rest, rest, w, np.empty(n))
    mass_matrix(chain, delta, w, mass)
    return mass


EFFECT = Backlash()
