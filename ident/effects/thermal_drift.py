"""Friction that changes while the arm warms up."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _coulomb(t, q, qd, load, joint, settings, resistance, level):
    level[joint] += settings[0] * np.expm1(-t / settings[1]) / np.expm1(-settings[2] / settings[1])


@term
def _viscous(t, q, qd, load, joint, settings, resistance, level):
    part = np.expm1(-t / settings[1]) / np.expm1(-settings[2] / settings[1])
    resistance[joint] += settings[0] * part * qd[joint]


_COULOMB = Coefficient("coulomb_change", "N m")
_VISCOUS = Coefficient("viscous_change", "N m s/rad")
_FORMS = {"coulomb": (_COULOMB,), "viscous": (_VISCOUS,), "both": (_COULOMB, _VISCOUS)}
_SHORTEST_S = 30.0


class _Warming(NamedTuple):
    """Time constant [s], and the length of the run over which the change is told [s]."""

    time_constant: float
    over: float


class ThermalDrift(Effect[_Warming]):
    """tau = .. + (1 - exp(-t/T)) / (1 - exp(-D/T)) (dF sgn(qd) + dv qd).

    The change from the start to the end of the longest recording, of length D: what friction would
    come to long after it is not known, and need not be possible.
    """

    id = "thermal_drift"
    title = "friction that changes during the run, as it does when a drive warms up"
    equation = (
        "tau_j += (1 - exp(-t/time_constant)) / (1 - exp(-D/time_constant)) (coulomb_change"
        " sgn(qd_j) + viscous_change qd_j), D the run's length"
    )
    source = "Bittencourt, Axelsson 2014, eq. (4), as a first-order warm-up"
    signature = "the same motion needs another torque later in the run"
    rivals = ("load_dependent_friction",)
    intervention = "warm the arm up for half an hour and record the same motion again"
    experiment = "repeat one motion at the start, in the middle, and at the end of a long run"
    form_uncertainty = FormUncertainty.TIME
    depends_on = ("direction",)
    has_memory = True
    Parameters = _Warming
    nonlinear = (
        NonlinearParameter("time_constant", "s", (10.0, 20.0, 40.0, 80.0, 300.0), 8.0, 2000.0),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Warming]]:
        """One for each joint and time constant: Coulomb or viscous friction, or both.

        None in short recordings: drives warm up over minutes, and in a few reversals time and
        motion are the same.
        """
        if arm.duration_s < _SHORTEST_S:
            return []
        return [
            self.at((j,), _Warming(constant, arm.duration_s), form)
            for j in arm.moving_joints
            for form in _FORMS
            for constant in self.nonlinear[0].grid
            if constant <= 5 * arm.duration_s
        ]

    def coefficients(self, parameters: _Warming, variant: str) -> tuple[Coefficient, ...]:
        """The change of one of them, or of both."""
        return _FORMS[variant]

    def is_plausible(
        self,
        candidate: Candidate[_Warming],
        values: Array,
        friction: tuple[float, float],
        tuned: bool,
    ) -> bool:
        """Dry friction brakes from the start of the run to its end."""
        change = float(values[0]) if candidate.variant != "viscous" else 0.0
        return friction[1] >= 0.0 and friction[1] + change >= 0.0

    def columns(self, seen: Observed, candidate: Candidate[_Warming]) -> Array:
        """Direction, and speed, growing with time."""
        j, constant = candidate.joints[0], candidate.parameters.time_constant
        grown = np.expm1(-seen.t / constant) / np.expm1(-candidate.parameters.over / constant)
        parts = {"coulomb": [seen.direction[:, j]], "viscous": [seen.qd[:, j]]}
        parts["both"] = parts["coulomb"] + parts["viscous"]
        return np.stack([grown * p for p in parts[candidate.variant]], axis=-1)[:, None, :]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Warming], values: Array
    ) -> SimulatedArm:
        """A Coulomb level and a drag that change."""
        functions = {"coulomb": (_coulomb,), "viscous": (_viscous,), "both": (_coulomb, _viscous)}
        constant, over = candidate.parameters
        items = [
            Term(f, candidate.joints[0], (v, constant, over))
            for f, v in zip(functions[candidate.variant], values, strict=True)
        ]
        return arm.with_terms(*items)


EFFECT = ThermalDrift()
