"""Friction that depends on the distance since the last reversal."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.bristle import stretch
from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_FORMS = {
    "dahl": "tau_j += friction z, dz/dq_j = (1 - z sgn(qd_j)) / distance",
    "slip": "tau_j += friction z, dz/dq_j = 1 / distance, |z| <= 1",
}


class _Bristle(NamedTuple):
    """A bristle that stretches over a distance [rad]."""

    distance: float


class Presliding(Effect[_Bristle]):
    """tau = .. + F z, dz/dq = (1 - z sgn(qd)) / distance."""

    id = "presliding"
    title = "friction that gives way like a bristle before the joint slides"
    equation = f"{_FORMS['dahl']}; or linear up to |z| = 1"
    source = "Dahl 1968; Canudas de Wit et al. 1995, eqs. (1)-(3), at low speed"
    signature = "depends on the distance since the last reversal, not on speed"
    rivals = ("stribeck", "backlash", "joint_elasticity")
    experiment = "slow reversals with several amplitudes, from 1 to 50 mrad"
    motion = ExperimentMotion.SLOW_REVERSALS
    has_memory = True
    linear = (Coefficient("friction", "N m", lower=0.0),)
    Parameters = _Bristle
    nonlinear = (
        NonlinearParameter("distance", "rad", (0.0016, 0.003, 0.006, 0.012, 0.025), 1e-3, 0.06),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Bristle]]:
        """One for each joint, distance and form."""
        return [
            self.at((j,), _Bristle(d), form)
            for j in arm.moving_joints
            for form in _FORMS
            for d in self.nonlinear[0].grid
        ]

    def columns(self, seen: Observed, candidate: Candidate[_Bristle]) -> Array:
        """The bristle's state along the measured path."""
        q = seen.q[:, candidate.joints[0]]
        slips = candidate.variant == "slip"
        return stretch(q, candidate.parameters.distance, slips)[:, None, None]

    def equation_of(self, candidate: Candidate[_Bristle]) -> str:
        """Dahl's, or that of an element that slips."""
        return _FORMS[candidate.variant]

    def static_columns(self, seen: Observed, candidate: Candidate[_Bristle]) -> Array:
        """The bristle at its end: long after a reversal."""
        return np.sign(seen.qd[:, candidate.joints[0]])[:, None, None]

    def memory_distance(self, candidate: Candidate[_Bristle]) -> float:
        """The way over which the bristle stretches."""
        return candidate.parameters.distance

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Bristle], values: Array
    ) -> SimulatedArm:
        """A friction element with a bristle, in place of the rigid one."""
        j = candidate.joints[0]
        coulomb, bristle = arm.coulomb.copy(), arm.bristle.copy()
        coulomb[j] += values[0]
        bristle[j] = candidate.parameters.distance
        return replace(arm, coulomb=coulomb, bristle=bristle)


EFFECT = Presliding()
