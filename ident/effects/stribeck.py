"""Friction that is higher at low speed."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _stribeck(t, q, qd, load, joint, settings, resistance, level):
    power = (abs(qd[joint]) / settings[1]) ** settings[2]
    level[joint] += settings[0] * (np.exp(-power) if settings[3] == 0.0 else 1.0 / (1.0 + power))


class _Curve(NamedTuple):
    """Stribeck speed [rad/s], exponent, and whether it decays slowly (1) or not (0)."""

    speed: float
    exponent: float
    slow_decay: float = 0.0


class Stribeck(Effect[_Curve]):
    """tau = .. + dF exp(-(|qd|/vs)^d) sgn(qd), or with a slower decay dF / (1 + (|qd|/vs)^d)."""

    id = "stribeck"
    title = "extra friction at low speed (Stribeck effect)"
    equation = (
        "tau_j += extra_friction exp(-(|qd_j|/speed)^exponent) sgn(qd_j); with slow_decay = 1:"
        " extra_friction / (1 + (|qd_j|/speed)^exponent) sgn(qd_j)"
    )
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, eq. (9); slow decay: Hess, Soom 1990"
    signature = "follows the direction of motion, only at low speed"
    rivals = ("nonlinear_viscous", "presliding")
    experiment = "cross many constant speeds from a third of the Stribeck speed to five times it"
    motion = ExperimentMotion.SLOW_REVERSALS
    form_uncertainty = FormUncertainty.SPEED
    depends_on = ("direction",)
    linear = (Coefficient("extra_friction", "N m", lower=0.0),)
    Parameters = _Curve
    nonlinear = (
        NonlinearParameter(
            "speed", "rad/s", (0.015, 0.025, 0.04, 0.06, 0.09, 0.13, 0.2, 0.3), 0.008, 0.5
        ),
        NonlinearParameter("exponent", "1", (0.7, 1.0, 1.4, 2.0), 0.7, 2.0, discrete=True),
        NonlinearParameter(
            "slow_decay", "1", (0.0, 1.0), 0.0, 1.0, discrete=True, refine_only=True
        ),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Curve]]:
        """One for each joint, Stribeck speed and exponent."""
        speed, exponent, _ = self.nonlinear
        return [
            self.at((j,), _Curve(v, d))
            for j in arm.moving_joints
            for d in exponent.grid
            for v in speed.grid
        ]

    def columns(self, seen: Observed, candidate: Candidate[_Curve]) -> Array:
        """Direction of motion, fading with speed."""
        j = candidate.joints[0]
        return (seen.direction[:, j] * _fade(candidate, seen.speed[:, j]))[:, None, None]

    def unobserved_fraction(self, candidate: Candidate[_Curve], slow: float) -> float:
        """What has faded at that speed."""
        return 1.0 - float(_fade(candidate, np.array(slow)))

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Curve], values: Array
    ) -> SimulatedArm:
        """A Coulomb level that falls with speed."""
        shape = candidate.parameters
        j, extra = candidate.joints[0], float(values[0])
        settings = (extra, shape.speed, shape.exponent, shape.slow_decay)
        power = f"pow(fabs(qd[{j}]) / {shape.speed!r}, {shape.exponent!r})"
        fade = f"1.0 / (1.0 + {power})" if shape.slow_decay else f"exp(-{power})"
        text = f"{extra!r} * ({fade}) * sgn(qd[{j}])"
        return arm.with_terms(Term(_stribeck, j, settings, ((j, text),)))


def _fade(candidate: Candidate[_Curve], speed: Array) -> Array:
    """Part of the extra friction that is left at a speed [rad/s]."""
    shape = candidate.parameters
    power = (np.abs(speed) / shape.speed) ** shape.exponent
    return 1.0 / (1.0 + power) if shape.slow_decay else np.exp(-power)


EFFECT = Stribeck()
