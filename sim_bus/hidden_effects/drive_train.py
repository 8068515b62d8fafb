"""Effects between the drives and the joints: motors, cables, transmission.

`joints` are motors in all of them but `RotorInertia`, `JointElasticity` and `Backlash`.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np

from sim_bus.hidden_effects.effect import (
    Acts,
    Array,
    AtJoints,
    Elsewhere,
    NotNegative,
    NotNegativeSizes,
    Number,
    Positive,
    PositiveSizes,
    Share,
    Sizes,
    on_motors,
)
from sim_bus.hidden_effects.transmission import Tie, with_motor_beside
from sim_bus.plant.physics import Physics, StepState


class RotorInertia(AtJoints):
    """Inertia that turns with a joint."""

    effect: Literal["rotor_inertia"]
    kg_m2: NotNegativeSizes

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Joint side."""
        more = np.diag(self.spread(self.kg_m2, physics))
        return replace(physics, armature=physics.armature + more)


class CoupledInertia(AtJoints):
    """Inertia of rotors, through the transmission."""

    effect: Literal["coupled_inertia"]
    kg_m2: NotNegativeSizes

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Motor side."""
        t = physics.truth.motor_from_joint
        more = t.T @ np.diag(self.spread(self.kg_m2, physics)) @ t
        return replace(physics, armature=physics.armature + more)


class TorqueGain(Acts):
    """Motors that make another torque than their drives believe."""

    effect: Literal["torque_gain"]
    factor: Annotated[Sizes, Elsewhere(1.0)]

    at_motors: ClassVar[bool] = True

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The torque times the factor."""
        state.motor *= sizes["factor"]


class TorqueDelay(AtJoints):
    """Torque that comes late: after a pure delay, or through a lag of first order."""

    effect: Literal["torque_delay"]
    form: Literal["delay", "lag"] = "delay"
    seconds: Positive

    def hide(self, physics: Physics, seed: int) -> Physics:
        """A delay is rounded to whole inner steps."""
        here = self.spread(1.0, physics) > 0.0
        past: deque[Array] = deque()
        made = np.zeros(physics.dof)

        def delay(state: StepState) -> None:
            past.append(state.motor.copy())
            if len(past) > round(self.seconds / state.step_s):
                made[:] = past.popleft()
            state.motor[here] = made[here]

        def lag(state: StepState) -> None:
            share = 1.0 - np.exp(-state.step_s / self.seconds)
            made[:] += share * (state.motor - made)
            state.motor[here] = made[here]

        return on_motors(physics, delay if self.form == "delay" else lag)


class TorqueRipple(AtJoints):
    """Cogging: torque that is periodic in the motor's angle, whatever torque it makes."""

    effect: Literal["torque_ripple"]
    nm: Sizes
    periods_per_turn: Positive = 12.0
    phase_rad: Number = 0.0

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Motor side."""
        size = self.spread(self.nm, physics)
        t = physics.truth.motor_from_joint

        def act(state: StepState) -> None:
            angle = self.periods_per_turn * (t @ state.q) + self.phase_rad
            state.motor += size * np.sin(angle)

        return on_motors(physics, act)


class TorqueSaturation(Acts):
    """Torque that stays below what was commanded, and that the drive shows as made."""

    effect: Literal["torque_saturation"]
    nm: Annotated[PositiveSizes, Elsewhere(np.inf)]

    at_motors: ClassVar[bool] = True

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """Motor side."""
        np.clip(state.motor, -sizes["nm"], sizes["nm"], out=state.motor)


class JointElasticity(AtJoints):
    """A transmission that gives way under load: a spring with a damper between motor and link."""

    effect: Literal["joint_elasticity"]
    nm_rad: PositiveSizes
    damping: NotNegative = 0.1
    motor_kg_m2: PositiveSizes = 0.02
    friction_on_motor: Share = 0.5

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The encoder turns with the motor, which is a part of the joint's inertia."""
        stiffness = self.spread(self.nm_rad, physics)
        inertia = self.spread(self.motor_kg_m2, physics)
        for j in (joint - 1 for joint in self.joints):
            tie = Tie(j, 0.0, stiffness[j], self.damping, inertia[j], self.friction_on_motor)
            physics = with_motor_beside(physics, tie)
        return physics


class Backlash(AtJoints):
    """A dead zone between motor and link, which ends at two hard stops.

    The stops give by a swing of `stops_hz`, of the motor on them.
    """

    effect: Literal["backlash"]
    rad: NotNegativeSizes
    stops_hz: Positive = 150.0
    damping: NotNegative = 0.5
    motor_kg_m2: PositiveSizes = 0.02
    friction_on_motor: Share = 0.5

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The encoder turns with the motor, which is a part of the joint's inertia."""
        half = 0.5 * self.spread(self.rad, physics)
        inertia = self.spread(self.motor_kg_m2, physics)
        for j in (joint - 1 for joint in self.joints):
            stiffness = inertia[j] * (2.0 * np.pi * self.stops_hz) ** 2
            tie = Tie(j, half[j], stiffness, self.damping, inertia[j], self.friction_on_motor)
            physics = with_motor_beside(physics, tie)
        return physics


Effects = (
    RotorInertia
    | CoupledInertia
    | TorqueGain
    | TorqueDelay
    | TorqueRipple
    | TorqueSaturation
    | JointElasticity
    | Backlash
)
