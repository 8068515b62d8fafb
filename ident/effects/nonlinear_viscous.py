"""Drag that is not proportional to speed."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

_NEGATIVE = 0.05  # of the drag at 1 rad/s: so much is no error of a small viscous part


@term
def _drag(t, q, qd, load, joint, settings, resistance, level):
    size = settings[0] * abs(qd[joint]) ** settings[1]
    if settings[1] >= 1.0:
        resistance[joint] += size * np.sign(qd[joint])
    else:
        level[joint] += size


class _Power(NamedTuple):
    """The power of the speed."""

    power: float


class NonlinearViscous(Effect[_Power]):
    """tau = .. + b |qd|^p sgn(qd)."""

    id = "nonlinear_viscous"
    title = "drag that is not proportional to speed"
    equation = "tau_j += drag |qd_j|^power sgn(qd_j)"
    source = "viscous drag of lubricants and air; power 2 quadratic, 3 cubic, 0.5 sub-linear"
    signature = "follows the direction of motion; the friction curve is bent at high speed"
    rivals = ("stribeck", "asymmetric_viscous")
    experiment = "constant speeds up to the joint's limit, evenly spread"
    motion = ExperimentMotion.SPEED_STAIRCASE
    form_uncertainty = FormUncertainty.SPEED
    band_limited = True
    Parameters = _Power
    nonlinear = (NonlinearParameter("power", "1", (0.5, 1.5, 2.0, 3.0), 0.3, 4.0),)

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Power]]:
        """One for each joint and power.

        A sub-linear drag with a negative coefficient would be Stribeck friction by another name.
        """
        grid = self.nonlinear[0].grid
        return [self.at((j,), _Power(p)) for j in arm.moving_joints for p in grid]

    def coefficients(self, parameters: _Power, variant: str) -> tuple[Coefficient, ...]:
        """The drag at 1 rad/s."""
        power = parameters.power
        lower = 0.0 if power < 1.0 else -np.inf
        return (Coefficient("drag", f"N m (s/rad)^{power:g}", lower=lower),)

    def is_plausible(
        self,
        candidate: Candidate[_Power],
        values: Array,
        friction: tuple[float, float],
        tuned: bool,
    ) -> bool:
        """Not if friction falls with speed from rest on: that, too, would be Stribeck friction."""
        return friction[0] >= -_NEGATIVE * abs(float(values[0]))

    def columns(self, seen: Observed, candidate: Candidate[_Power]) -> Array:
        """A power of the speed, with its sign."""
        qd = seen.qd[:, candidate.joints[0]]
        power = candidate.parameters.power
        return (np.sign(qd) * np.abs(qd) ** power)[:, None, None]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Power], values: Array
    ) -> SimulatedArm:
        """A drag; sub-linear ones act on the Coulomb level: their slope at rest is infinite."""
        j, drag, power = candidate.joints[0], float(values[0]), candidate.parameters.power
        text = f"{drag!r} * pow(fabs(qd[{j}]), {power!r}) * sgn(qd[{j}])"
        return arm.with_terms(Term(_drag, j, (drag, power), ((j, text),)))


EFFECT = NonlinearViscous()
