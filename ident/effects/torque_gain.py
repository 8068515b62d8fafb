"""A drive that gives more or less torque than it is asked for."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, Value
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class _Motor(NamedTuple):
    """A motor that two joints share; none where the drive is one joint's own.

    Attributes:
        motor: its number, from 1; 0: the joint's own.
        shares: joint torques that it makes of those that are asked for, shape (2, 2).
    """

    motor: int = 0
    shares: tuple[tuple[float, ...], ...] = ()


class TorqueGain(Effect[_Motor]):
    """(1 + e) tau = model; fitted as tau = (1 + s) model.

    Of a differential, each motor has a gain: tau + e P tau = model, fitted as tau = model +
    s P model, where P = P P is what one motor does of the two joints' torques.
    """

    id = "torque_gain"
    title = "a wrong torque constant or gear ratio"
    equation = (
        "(1 + error) tau_j = tau_model,j: the drive gives 1 + error of what it is asked for"
        " (model.yaml has the torque's: tau_j = (1 + error) tau_model,j); of a motor m that two"
        " joints share, tau + error_of_motor_m P tau = tau_model, P = T^T E_m T^-T"
    )
    source = "Gautier, Briot 2011, eq. (9)"
    signature = "in proportion to the whole torque of the joint, or of the two that share a motor"
    rivals = ("load_dependent_friction",)
    experiment = "the same motion with a known payload"
    motion = ExperimentMotion.LOAD_CHANGES
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    depends_on = ("direction", "model", "friction")
    Parameters = _Motor

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Motor]]:
        """One for each moving joint, and for each motor that two of them share.

        Beside a reference model, one for all joints alike: a log in another unit, another supply.
        Links that are fitted to the same recordings take such a factor up.
        """
        whole = [arm.moving_joints] if arm.trusted and arm.moving_joints else []
        places = dict.fromkeys([*((j,) for j in arm.moving_joints), *whole])
        return [self.at(joints) for joints in places] + [
            self.at(pair, motor) for pair in arm.coupled_pairs for motor in _motors(arm, pair)
        ]

    def coefficients(self, parameters: _Motor, variant: str) -> tuple[Coefficient, ...]:
        """The error of the joint's drive, or of the motor that is told."""
        name = f"error_of_motor_{parameters.motor}" if parameters.motor else "error"
        return (Coefficient(name, "1", lower=-0.75, upper=3.0),)

    def columns(self, seen: Observed, candidate: Candidate[_Motor]) -> Array:
        """The joint's rigid-body torque; friction's own parameters absorb friction's share.

        Where a motor is shared, the friction of one joint appears at the other too.
        """
        joints = list(candidate.joints)
        load = seen.load[:, joints]
        if not candidate.parameters.motor:
            return (load + seen.arm.of_drives(seen.qdd)[:, joints])[:, :, None]
        friction = seen.viscous * seen.qd + seen.coulomb * seen.direction
        shares = np.array(candidate.parameters.shares)
        return ((load + friction[:, joints]) @ shares.T)[:, :, None]

    def as_reported(
        self, candidate: Candidate[_Motor], values: dict[str, Value]
    ) -> dict[str, Value]:
        """The error of what the drive gives, not of what it was asked for."""
        ((name, more),) = values.items()
        gain = 1.0 / (1.0 + more.value)
        return {name: Value(gain - 1.0, more.sd * gain**2, "1")}

    def drive_factors(self, candidate: Candidate[_Motor], values: Array) -> dict[int, float]:
        """Of the joints' own drives."""
        own = () if candidate.parameters.motor else candidate.joints
        return {j: 1.0 + float(values[0]) for j in own}

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Motor], values: Array
    ) -> SimulatedArm:
        """A drive that gives another share of the command, in which friction was fitted."""
        if candidate.parameters.motor:
            pair, asked = np.ix_(candidate.joints, candidate.joints), arm.gain.copy()
            error = 1.0 / (1.0 + values[0]) - 1.0
            gives = np.eye(2) + error * np.array(candidate.parameters.shares)
            asked[pair] = gives @ asked[pair]
            return replace(arm, gain=asked)
        joints = list(candidate.joints)
        gain, viscous, coulomb = arm.gain.copy(), arm.viscous.copy(), arm.coulomb.copy()
        for scaled in gain, viscous, coulomb:
            scaled[joints] /= 1.0 + values[0]
        return replace(arm, gain=gain, viscous=viscous, coulomb=coulomb)


def _motors(arm: ArmFacts, pair: tuple[int, int]) -> list[_Motor]:
    """The two motors of a differential; none where it is not known how they turn with it."""
    if arm.motor_from_joint is None or not arm.knows_motors(pair):
        return []
    rows = np.flatnonzero((arm.motor_from_joint[:, list(pair)] != 0.0).all(axis=1))
    turns = arm.motor_from_joint[rows][:, list(pair)]
    if turns.shape != (2, 2):
        return []
    back = np.linalg.inv(turns)
    shares = [np.outer(turns[k], back[:, k]) for k in range(2)]
    return [
        _Motor(int(m) + 1, tuple(tuple(row) for row in share.tolist()))
        for m, share in zip(rows, shares, strict=True)
    ]


EFFECT = TorqueGain()
