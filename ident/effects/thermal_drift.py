"""Friction that changes while the arm warms up."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _coulomb(t, q, qd, load, joint, settings, resistance, level):
    level[joint] += settings[0] * np.expm1(-t / settings[1]) / np.expm1(-settings[2] / settings[1])


@term
def _viscous(t, q, qd, load, joint, settings, resistance, level):
    part = np.expm1(-t / settings[1]) / np.expm1(-settings[2] / settings[1])
    resistance[joint] += settings[0] * part * qd[joint]


class ThermalDrift:
    """tau = .. + (1 - exp(-t/T)) / (1 - exp(-D/T)) (dF sgn(qd) + dv qd).

    The change from the start to the end of the longest recording, of length D: what friction would
    come to long after it is not known, and need not be possible.
    """

    id = "thermal_drift"
    title = "friction that changes during the run, as it does when a drive warms up"
    equation = (
        "tau_j += (1 - exp(-t/T)) / (1 - exp(-D/T)) (dF sgn(qd_j) + dv qd_j), D the run's length"
    )
    source = "Bittencourt, Axelsson 2014, eq. (4), as a first-order warm-up"
    signature = "the same motion needs another torque later in the run"
    rivals = ("load_dependent_friction",)
    contains = ()
    experiment = "repeat one motion at the start, in the middle, and at the end of a long run"
    compares = False
    freedom = FormUncertainty.TIME
    smooth = False
    uses = ("direction",)
    settings = (Setting("time_constant", "s", (10.0, 20.0, 40.0, 80.0, 300.0), 8.0, 2000.0),)

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint and time constant: Coulomb or viscous friction, or both."""
        coulomb = Coefficient("coulomb_change", "N m")
        viscous = Coefficient("viscous_change", "N m s/rad")
        forms = {"coulomb": (coulomb,), "viscous": (viscous,), "both": (coulomb, viscous)}
        over = {"over": arm.duration_s}
        return [
            Hypothesis(self.id, (j,), (j,), names, {"time_constant": constant, **over}, form)
            for j in arm.moving_joints
            for form, names in forms.items()
            for constant in self.settings[0].grid
            if constant <= 5 * arm.duration_s
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Direction, and speed, growing with time."""
        j, constant = hypothesis.joints[0], hypothesis.settings["time_constant"]
        grown = np.expm1(-seen.t / constant) / np.expm1(-hypothesis.settings["over"] / constant)
        parts = {"coulomb": [seen.direction[:, j]], "viscous": [seen.qd[:, j]]}
        parts["both"] = parts["coulomb"] + parts["viscous"]
        return np.stack([grown * p for p in parts[hypothesis.variant]], axis=-1)[:, None, :]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A Coulomb level and a drag that change."""
        functions = {"coulomb": (_coulomb,), "viscous": (_viscous,), "both": (_coulomb, _viscous)}
        constant, over = (hypothesis.settings[name] for name in ("time_constant", "over"))
        items = [
            Term(f, hypothesis.joints[0], (v, constant, over))
            for f, v in zip(functions[hypothesis.variant], values, strict=True)
        ]
        return replace(arm, terms=(*arm.terms, *items))


EFFECT = ThermalDrift()
