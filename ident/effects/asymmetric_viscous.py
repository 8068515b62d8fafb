"""Viscous friction that differs between the two directions."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _asymmetry(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0] * abs(qd[joint])


class AsymmetricViscous:
    """tau = .. + b |qd|."""

    id = "asymmetric_viscous"
    title = "viscous friction that differs between the two directions"
    equation = "tau_j += b |qd_j|"
    source = "half the difference of the coefficients of the two directions"
    signature = "grows with speed and points the same way in both directions"
    rivals = ("nonlinear_viscous", "torque_offset")
    contains = ()
    experiment = "several constant speeds in each direction over the same range"
    compares = False
    freedom = FormUncertainty.EITHER_WAY
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint."""
        half = (Coefficient("half_difference", "N m s/rad"),)
        return [Hypothesis(self.id, (j,), (j,), half) for j in arm.moving_joints]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """The size of the speed."""
        return np.abs(seen.qd[:, hypothesis.joints[0]])[:, None, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A torque that grows with the size of the speed."""
        item = Term(_asymmetry, hypothesis.joints[0], (values[0],))
        return replace(arm, terms=(*arm.terms, item))


EFFECT = AsymmetricViscous()
