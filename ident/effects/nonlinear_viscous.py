"""Drag that is not proportional to speed."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
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


class NonlinearViscous:
    """tau = .. + b |qd|^p sgn(qd)."""

    id = "nonlinear_viscous"
    title = "drag that is not proportional to speed"
    equation = "tau_j += b |qd_j|^p sgn(qd_j)"
    source = "viscous drag of lubricants and air; p = 2 quadratic, 3 cubic, 0.5 sub-linear"
    signature = "follows the direction of motion; the friction curve is bent at high speed"
    rivals = ("stribeck", "asymmetric_viscous")
    contains = ()
    experiment = "constant speeds up to the joint's limit, evenly spread"
    compares = False
    freedom = FormUncertainty.SPEED
    smooth = True
    uses = ()
    settings = (Setting("power", "1", (0.5, 1.5, 2.0, 3.0), 0.3, 4.0),)

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint and power.

        A sub-linear drag with a negative coefficient would be Stribeck friction by another name.
        """
        return [
            Hypothesis(self.id, (j,), (j,), self.coefficients({"power": p}), {"power": p})
            for j in arm.moving_joints
            for p in self.settings[0].grid
        ]

    def coefficients(self, settings: dict[str, float]) -> tuple[Coefficient, ...]:
        """The drag at 1 rad/s."""
        power = settings["power"]
        lower = 0.0 if power < 1.0 else -np.inf
        return (Coefficient("drag", f"N m (s/rad)^{power:g}", lower=lower),)

    def falls(self, values: Array, viscous: float) -> bool:
        """Whether the viscous part is clearly negative: that, too, would be Stribeck friction."""
        return viscous < -_NEGATIVE * abs(float(values[0]))

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """A power of the speed, with its sign."""
        qd = seen.qd[:, hypothesis.joints[0]]
        power = hypothesis.settings["power"]
        return (np.sign(qd) * np.abs(qd) ** power)[:, None, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A drag; sub-linear ones act on the Coulomb level: their slope at rest is infinite."""
        settings = (values[0], hypothesis.settings["power"])
        return replace(arm, terms=(*arm.terms, Term(_drag, hypothesis.joints[0], settings)))


EFFECT = NonlinearViscous()
