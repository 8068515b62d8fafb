"""Friction that is higher at low speed."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import ArmFacts, Array, Coefficient, Hypothesis, Observed, Setting
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _stribeck(t, q, qd, load, joint, settings, resistance, level):
    level[joint] += settings[0] * np.exp(-((abs(qd[joint]) / settings[1]) ** settings[2]))


class Stribeck:
    """tau = .. + dF exp(-(|qd|/vs)^d) sgn(qd)."""

    id = "stribeck"
    title = "extra friction at low speed (Stribeck effect)"
    equation = "tau_j += dF exp(-(|qd_j|/vs)^d) sgn(qd_j)"
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, eq. (9)"
    signature = "follows the direction of motion, only at low speed"
    rivals = ("nonlinear_viscous", "presliding")
    contains = ()
    experiment = "cross many constant speeds from a third of the Stribeck speed to five times it"
    compares = False
    exact = False
    smooth = False
    uses = ("direction",)
    settings = (
        Setting("speed", "rad/s", (0.015, 0.025, 0.04, 0.06, 0.09, 0.13, 0.2, 0.3), 0.008, 0.5),
        Setting("exponent", "1", (0.7, 1.0, 1.4, 2.0), 0.7, 2.0, whole=True),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint, Stribeck speed and exponent."""
        extra = (Coefficient("extra_friction", "N m", lower=0.0),)
        speed, exponent = self.settings
        return [
            Hypothesis(self.id, (j,), (j,), extra, {"speed": v, "exponent": d})
            for j in arm.moving_joints
            for d in exponent.grid
            for v in speed.grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Direction of motion, fading with speed."""
        j = hypothesis.joints[0]
        u = np.abs(seen.speed[:, j]) / hypothesis.settings["speed"]
        fade = np.exp(-(u ** hypothesis.settings["exponent"]))
        return (seen.direction[:, j] * fade)[:, None, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A Coulomb level that falls with speed."""
        shape = hypothesis.settings
        settings = (values[0], shape["speed"], shape["exponent"])
        return replace(arm, terms=(*arm.terms, Term(_stribeck, hypothesis.joints[0], settings)))


EFFECT = Stribeck()
