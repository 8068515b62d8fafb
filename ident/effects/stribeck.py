"""Friction that is higher at low speed."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _stribeck(t, q, qd, load, joint, settings, resistance, level):
    power = (abs(qd[joint]) / settings[1]) ** settings[2]
    level[joint] += settings[0] * (np.exp(-power) if settings[3] == 0.0 else 1.0 / (1.0 + power))


class Stribeck:
    """tau = .. + dF exp(-(|qd|/vs)^d) sgn(qd), or with a slower decay dF / (1 + (|qd|/vs)^d)."""

    id = "stribeck"
    title = "extra friction at low speed (Stribeck effect)"
    equation = "tau_j += dF exp(-(|qd_j|/vs)^d) sgn(qd_j), or dF / (1 + (|qd_j|/vs)^d) sgn(qd_j)"
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, eq. (9); slow decay: Hess, Soom 1990"
    signature = "follows the direction of motion, only at low speed"
    rivals = ("nonlinear_viscous", "presliding")
    contains = ()
    experiment = "cross many constant speeds from a third of the Stribeck speed to five times it"
    compares = False
    freedom = FormUncertainty.SPEED
    smooth = False
    uses = ("direction",)
    settings = (
        Setting("speed", "rad/s", (0.015, 0.025, 0.04, 0.06, 0.09, 0.13, 0.2, 0.3), 0.008, 0.5),
        Setting("exponent", "1", (0.7, 1.0, 1.4, 2.0), 0.7, 2.0, whole=True),
        Setting("slow_decay", "1", (0.0, 1.0), 0.0, 1.0, whole=True, late=True),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint, Stribeck speed and exponent."""
        extra = (Coefficient("extra_friction", "N m", lower=0.0),)
        speed, exponent, _ = self.settings
        return [
            Hypothesis(self.id, (j,), (j,), extra, {"speed": v, "exponent": d, "slow_decay": 0.0})
            for j in arm.moving_joints
            for d in exponent.grid
            for v in speed.grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Direction of motion, fading with speed."""
        j = hypothesis.joints[0]
        return (seen.direction[:, j] * _fade(hypothesis, seen.speed[:, j]))[:, None, None]

    def unseen(self, hypothesis: Hypothesis, slow: float) -> float:
        """What has faded at that speed."""
        return 1.0 - float(_fade(hypothesis, np.array(slow)))

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A Coulomb level that falls with speed."""
        shape = hypothesis.settings
        settings = (values[0], shape["speed"], shape["exponent"], shape["slow_decay"])
        return replace(arm, terms=(*arm.terms, Term(_stribeck, hypothesis.joints[0], settings)))


def _fade(hypothesis: Hypothesis, speed: Array) -> Array:
    """Part of the extra friction that is left at a speed [rad/s]."""
    shape = hypothesis.settings
    power = (np.abs(speed) / shape["speed"]) ** shape["exponent"]
    return 1.0 / (1.0 + power) if shape["slow_decay"] else np.exp(-power)


EFFECT = Stribeck()
