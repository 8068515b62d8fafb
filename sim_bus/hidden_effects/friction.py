"""Friction beyond Coulomb and viscous."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from sim_bus.hidden_effects.effect import (
    Acts,
    Array,
    AtJoints,
    NotNegative,
    NotNegativeSizes,
    Sizes,
    on_joints,
)
from sim_bus.plant.physics import Physics, StepState


class TorqueOffset(Acts):
    """A constant torque, or dry friction that is stronger in one direction by as much."""

    effect: Literal["torque_offset"]
    form: Literal["constant", "asymmetric_coulomb"] = "constant"
    nm: Sizes

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The offset resists positive motion where it is positive."""
        offset = sizes["nm"]
        if self.form == "constant":
            state.torque -= offset
        else:
            lower, upper = state.bounds[:, : len(offset)]
            np.minimum(lower + offset, 0.0, out=lower)
            np.maximum(upper + offset, 0.0, out=upper)


class Stribeck(Acts):
    """More dry friction at low speed."""

    effect: Literal["stribeck"]
    form: Literal["exponential", "gaussian"] = "exponential"
    extra_nm: NotNegativeSizes
    speed_rad_s: NotNegativeSizes

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The extra falls off with |qd| / speed, or with its square."""
        extra = sizes["extra_nm"]
        power = 1 if self.form == "exponential" else 2
        speed = sizes["speed_rad_s"] + (extra == 0.0)
        state.widen(extra * np.exp(-((np.abs(state.qd) / speed) ** power)))


class Presliding(AtJoints):
    """Friction that depends on the way since reversal, in the place of Coulomb friction.

    Dahl: a bristle z with dz/dt = qd (1 - sign(qd) s z / fc) and torque s z. LuGre: the same, with
    damping of the bristle and a level fc + extra exp(-(qd / speed)^2) in the place of fc.
    """

    effect: Literal["presliding"]
    form: Literal["dahl", "lugre"] = "dahl"
    stiffness_nm_rad: NotNegativeSizes
    damping_nm_s_rad: NotNegativeSizes = 0.0
    extra_nm: NotNegativeSizes = 0.0
    speed_rad_s: NotNegative = 0.05

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The bristles are massless; their motion is integrated implicitly, for they are stiff."""
        stiffness = self.spread(self.stiffness_nm_rad, physics)
        damping = self.spread(self.damping_nm_s_rad, physics)
        lugre = self.form == "lugre"
        extra = self.spread(self.extra_nm, physics) if lugre else np.zeros_like(stiffness)
        here = stiffness > 0.0
        coulomb = np.where(here, physics.truth.coulomb, 1.0)
        z = np.zeros_like(stiffness)

        def act(state: StepState) -> None:
            qd, h = state.qd, state.step_s
            level = coulomb + extra * np.exp(-((qd / self.speed_rad_s) ** 2))
            before = z.copy()
            z[:] = (z + h * qd) / (1.0 + h * stiffness * np.abs(qd) / level)
            bristle = stiffness * z
            if lugre:
                bristle += damping * (z - before) / h
            state.torque -= np.where(here, bristle, 0.0)

        truth = replace(physics.truth, coulomb=np.where(here, 0.0, physics.truth.coulomb))
        return on_joints(replace(physics, truth=truth), act)


class NonlinearViscous(Acts):
    """Drag that does not grow in proportion to speed: linear, quadratic, cubic, or by a power."""

    effect: Literal["nonlinear_viscous"]
    quadratic_nm_s2_rad2: Sizes = 0.0
    cubic_nm_s3_rad3: Sizes = 0.0
    power_nm: Sizes = 0.0
    power: NotNegative = 0.5

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The power law is that of speed over 1 rad/s."""
        speed = np.abs(state.qd)
        state.drag += sizes["quadratic_nm_s2_rad2"] * speed + sizes["cubic_nm_s3_rad3"] * speed**2
        state.torque -= sizes["power_nm"] * np.sign(state.qd) * speed**self.power


class AsymmetricViscous(Acts):
    """Viscous friction that is stronger in the positive direction, and weaker in the negative."""

    effect: Literal["asymmetric_viscous"]
    nm_s_rad: Sizes

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """The coefficient differs from its mean by the given size, either way."""
        state.drag += sizes["nm_s_rad"] * np.sign(state.qd)


class LoadDependentFriction(Acts):
    """Dry friction that grows with the torque that the transmission carries."""

    effect: Literal["load_dependent_friction"]
    share: NotNegativeSizes

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """A share of the motors' torque at the joint."""
        state.widen(sizes["share"] * np.abs(state.load))


class CoupledFriction(AtJoints):
    """Friction on motors, which a differential shares among joints; `joints` are motors here."""

    effect: Literal["coupled_friction"]
    coulomb_nm: NotNegativeSizes
    viscous_nm_s_rad: NotNegativeSizes = 0.0

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Motor side, both sizes."""
        transmission = physics.truth.motor_from_joint
        coulomb = self.spread(self.coulomb_nm, physics)
        viscous = np.diag(self.spread(self.viscous_nm_s_rad, physics))
        motors = np.flatnonzero(coulomb)
        return replace(
            physics,
            slides=np.vstack([physics.slides, transmission[motors]]),
            slide_torque=np.concatenate([physics.slide_torque, coulomb[motors]]),
            drag=physics.drag + transmission.T @ viscous @ transmission,
        )


class ThermalDrift(AtJoints):
    """Friction of a cold arm, which falls as the arm warms up."""

    effect: Literal["thermal_drift"]
    share: Sizes
    time_constant_s: NotNegative
    viscous: bool = True

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Coulomb and viscous friction are 1 + share exp(-t / time constant) times their own."""
        share = self.spread(self.share, physics)
        own = physics.truth.viscous if self.viscous else np.zeros(physics.dof)

        def act(state: StepState) -> None:
            more = share * np.exp(-state.time_s / self.time_constant_s)
            state.bounds[:, : physics.dof] *= 1.0 + more
            state.drag += own * more

        return on_joints(physics, act)


Effects = (
    TorqueOffset
    | Stribeck
    | Presliding
    | NonlinearViscous
    | AsymmetricViscous
    | LoadDependentFriction
    | CoupledFriction
    | ThermalDrift
)
