"""Viscous friction that differs between the two directions."""

import numpy as np

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _asymmetry(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0] * abs(qd[joint])


class AsymmetricViscous(Effect):
    """tau = .. + b |qd|."""

    id = "asymmetric_viscous"
    title = "viscous friction that differs between the two directions"
    equation = "tau_j += half_difference |qd_j|"
    source = "half the difference of the coefficients of the two directions"
    signature = "grows with speed and points the same way in both directions"
    rivals = ("nonlinear_viscous", "torque_offset")
    experiment = "several constant speeds in each direction over the same range"
    motion = ExperimentMotion.SPEED_STAIRCASE
    form_uncertainty = FormUncertainty.EITHER_WAY
    band_limited = True
    linear = (Coefficient("half_difference", "N m s/rad"),)

    def columns(self, seen: Observed, candidate: Candidate) -> Array:
        """The size of the speed."""
        return np.abs(seen.qd[:, candidate.joints[0]])[:, None, None]

    def simulated(self, arm: SimulatedArm, candidate: Candidate, values: Array) -> SimulatedArm:
        """A torque that grows with the size of the speed."""
        j, half = candidate.joints[0], float(values[0])
        return arm.with_terms(Term(_asymmetry, j, (half,), ((j, f"{half!r} * fabs(qd[{j}])"),)))


EFFECT = AsymmetricViscous()
