"""Effects that are in nobody's catalogue, so that a search for a name should find none."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from sim_bus.hidden_effects.effect import (
    Acts,
    Array,
    AtJoints,
    Elsewhere,
    HiddenEffect,
    NotNegative,
    NotNegativeSizes,
    Number,
    Positive,
    Sizes,
    on_joints,
    on_motors,
)
from sim_bus.plant.physics import Physics, StepState

JointNumber = Annotated[int, Field(ge=1)]


class MassChange(HiddenEffect):
    """The arm picks something up in the middle of the run: a weight, without inertia."""

    effect: Literal["mass_change"]
    joint: JointNumber
    nm: Number
    at_s: NotNegative

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Torque -nm sin(q) at one joint, from a time on."""

        def act(state: StepState) -> None:
            if state.time_s >= self.at_s:
                state.torque[self.joint - 1] -= self.nm * np.sin(state.q[self.joint - 1])

        return on_joints(physics, act)


class OneSidedStop(Acts):
    """A soft bumper beyond an angle."""

    effect: Literal["one_sided_stop"]
    nm_rad: Sizes
    beyond_rad: Annotated[Sizes, Elsewhere(np.inf)]

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """It pushes back in proportion to the square root of the depth, from the angle upwards."""
        depth = np.maximum(state.q - sizes["beyond_rad"], 0.0)
        state.torque -= sizes["nm_rad"] * np.sqrt(depth)


class Hose(Acts):
    """A hose that curls, with a torque that is no spring's."""

    effect: Literal["hose"]
    nm: Sizes
    phase_rad: Number = 0.3

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """Torque -nm sin(2 q - phase)."""
        state.torque -= sizes["nm"] * np.sin(2.0 * state.q - self.phase_rad)


class AngleDependentDrag(Acts):
    """Viscous friction that differs from angle to angle."""

    effect: Literal["angle_dependent_drag"]
    nm_s_rad: Sizes
    phase_rad: Number = 0.0

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The coefficient grows by size (1 + cos(q - phase)) / 2."""
        state.drag += sizes["nm_s_rad"] * 0.5 * (1.0 + np.cos(state.q - self.phase_rad))


class AngleDependentFriction(Acts):
    """Dry friction that differs from angle to angle."""

    effect: Literal["angle_dependent_friction"]
    nm: Sizes
    periods_per_turn: Positive = 2.0

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The bound grows by size (1 + cos(periods q)) / 2."""
        state.widen(sizes["nm"] * 0.5 * (1.0 + np.cos(self.periods_per_turn * state.q)))


class DamagedTooth(Acts):
    """Dry friction at one angle."""

    effect: Literal["damaged_tooth"]
    nm: Sizes
    at_rad: Number
    width_rad: Positive = 0.05

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The bound grows by a bell curve around the angle."""
        away = (state.q - self.at_rad) / self.width_rad
        state.widen(sizes["nm"] * np.exp(-(away**2)))


class CrossDrag(HiddenEffect):
    """One joint is dragged by another one's motion, and not the other way round."""

    effect: Literal["cross_drag"]
    joint: JointNumber
    driven_by: JointNumber
    nm_s_rad: Number

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Torque -size qd of the other joint."""

        def act(state: StepState) -> None:
            state.torque[self.joint - 1] -= self.nm_s_rad * state.qd[self.driven_by - 1]

        return on_joints(physics, act)


class Vibration(Acts):
    """Something shakes the arm, whatever it does."""

    effect: Literal["vibration"]
    nm: Sizes
    hz: Positive

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """Torque nm sin(2 pi hz t)."""
        state.torque += sizes["nm"] * np.sin(2.0 * np.pi * self.hz * state.time_s)


class Slosh(AtJoints):
    """A liquid on the arm, a damped oscillator that the joint's motion drives."""

    effect: Literal["slosh"]
    kg_m2: Sizes
    hz: Positive
    damping_ratio: NotNegative = 0.05

    def hide(self, physics: Physics, seed: int) -> Physics:
        """An inertia on a spring and a damper at the joint, integrated half implicitly."""
        inertia = self.spread(self.kg_m2, physics)
        omega = 2.0 * np.pi * self.hz
        fluid = np.zeros((2, physics.dof))
        started = np.zeros(1)

        def act(state: StepState) -> None:
            angle, speed = fluid
            if not started[0]:
                angle[:], started[0] = state.q, 1.0
            stretch, rate = angle - state.q, speed - state.qd
            pull = omega**2 * stretch + 2.0 * self.damping_ratio * omega * rate
            speed -= state.step_s * pull
            angle += state.step_s * speed
            state.torque += inertia * pull

        return on_joints(physics, act)


class HysteresisLoop(AtJoints):
    """A rate-independent loop over a wide angle, as of a bent cable (Bouc, Wen)."""

    effect: Literal["hysteresis_loop"]
    nm: Sizes
    width_rad: Positive = 0.3

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Torque -nm z with dz/dq = (1 - |z|^2 (1 + sign(z qd)) / 2) / width."""
        size = self.spread(self.nm, physics)
        z = np.zeros(physics.dof)

        def act(state: StepState) -> None:
            way = state.qd * state.step_s
            z[:] += way * (1.0 - z * z * 0.5 * (1.0 + np.sign(z * way))) / self.width_rad
            state.torque -= size * z

        return on_joints(physics, act)


class SpeedLimitedTorque(AtJoints):
    """Torque that the supply voltage allows only below a no-load speed."""

    effect: Literal["speed_limited_torque"]
    stall_nm: Positive
    no_load_rad_s: Positive

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Motor side: at most stall (1 - speed / no-load speed) in the direction of motion."""
        here = self.spread(1.0, physics) > 0.0
        t = physics.truth.motor_from_joint

        def act(state: StepState) -> None:
            speed = t @ state.qd
            most = self.stall_nm * np.maximum(0.0, 1.0 - np.abs(speed) / self.no_load_rad_s)
            driving = here & (speed * state.motor > 0.0)
            limited = np.clip(state.motor, -most, most)
            state.motor[driving] = limited[driving]

        return on_motors(physics, act)


class TorqueDeadZone(Acts):
    """A drive that makes no torque near zero."""

    effect: Literal["torque_dead_zone"]
    nm: NotNegativeSizes

    at_motors: ClassVar[bool] = True

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """Motor side: the torque is smaller by the zone, and zero within it."""
        state.motor -= np.clip(state.motor, -sizes["nm"], sizes["nm"])


class SupplySag(AtJoints):
    """Torque that sinks as all motors together draw power."""

    effect: Literal["supply_sag"]
    share_per_watt: NotNegative

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The named motors lose a share of their torque for each watt that all motors deliver."""
        here = self.spread(1.0, physics)
        t = physics.truth.motor_from_joint

        def act(state: StepState) -> None:
            watts = np.abs(state.motor * (t @ state.qd)).sum()
            state.motor *= 1.0 - here * min(0.9, self.share_per_watt * watts)

        return on_motors(physics, act)


Effects = (
    MassChange
    | OneSidedStop
    | Hose
    | AngleDependentDrag
    | AngleDependentFriction
    | DamagedTooth
    | CrossDrag
    | Vibration
    | Slosh
    | HysteresisLoop
    | SpeedLimitedTorque
    | TorqueDeadZone
    | SupplySag
)
