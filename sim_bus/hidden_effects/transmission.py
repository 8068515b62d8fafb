"""A motor beside its link: a transmission with play between them, or one that gives.

The motor carries the encoder, and a part of the joint's inertia and friction. Between its stops it
moves freely; beyond them, or from the start, a spring with a damper pushes motor and link apart.
"""

from dataclasses import dataclass, replace

import numpy as np

from sim_bus.hidden_effects.effect import Array, at_encoders, on_joints
from sim_bus.plant.physics import Physics, StepState

_TURN = 0.3  # rad of the fastest swing in one part of a step


@dataclass(frozen=True)
class Tie:
    """What ties the motor of one joint to its link.

    Attributes:
        joint: from 0.
        half_play: from the middle to either stop [rad].
        stiffness: beyond [N m/rad].
        damping: of it, as a part of the critical one of the motor.
        inertia: of the motor, a part of the joint's [kg m^2].
        share: part of the joint's friction that acts on the motor.
    """

    joint: int
    half_play: float
    stiffness: float
    damping: float
    inertia: float
    share: float


class _Motor:
    """A motor's motion beside its link, step by step."""

    def __init__(self, tie: Tie, viscous: float) -> None:
        self._tie = tie
        self._viscous = tie.share * viscous
        self._damping = 2.0 * tie.damping * np.sqrt(tie.stiffness * tie.inertia)
        self._speed: float | None = None
        self.beside = 0.0

    def act(self, state: StepState) -> None:
        """The link gets what the transmission carries, in the place of the motor's torque."""
        tie, j = self._tie, self._tie.joint
        link = float(state.qd[j])
        if self._speed is None:
            self._speed = link
        swing = np.sqrt(tie.stiffness / tie.inertia)
        parts = int(np.ceil(swing * state.step_s / _TURN))
        h, carried = state.step_s / parts, 0.0
        least, most = tie.share * state.bounds[:, j]
        for _ in range(parts):
            push = self._push(self._speed - link)
            free = self._speed + h * (float(state.load[j]) - push) / tie.inertia
            rubbed = free - float(np.clip(free, h * least / tie.inertia, h * most / tie.inertia))
            self._speed = rubbed / (1.0 + h * self._viscous / tie.inertia)
            self.beside += h * (self._speed - link)
            carried += push / parts
        state.torque[j] += carried - state.load[j]
        state.drag[j] -= self._viscous
        state.bounds[:, j] *= 1.0 - tie.share

    def _push(self, speed: float) -> float:
        """Torque on the link [N m], which the stops never pull."""
        half = self._tie.half_play
        beyond = self.beside - float(np.clip(self.beside, -half, half))
        if beyond == 0.0:
            return 0.0
        push = self._tie.stiffness * beyond + self._damping * speed
        return push if half == 0.0 or push * beyond > 0.0 else 0.0


def with_motor_beside(physics: Physics, tie: Tie) -> Physics:
    """The same arm, in which one motor moves beside its link."""
    truth, j = physics.truth, tie.joint
    motor = _Motor(tie, float(truth.viscous[j]))
    armature = physics.armature.copy()
    armature[j, j] -= tie.inertia

    def reading(q: Array, state: StepState) -> Array:
        seen = q.copy()
        seen[j] += motor.beside
        return seen

    return at_encoders(on_joints(replace(physics, armature=armature), motor.act), reading)
