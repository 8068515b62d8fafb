"""A push or a contact during a stretch of time."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _push(t, q, qd, load, joint, settings, resistance, level):
    if settings[1] <= t < settings[2]:
        resistance[joint] += settings[0]


class Contact:
    """tau = .. + f between t1 and t2."""

    id = "contact"
    title = "a push or a contact during a stretch of time"
    equation = "tau_j += f_j for t1 <= t < t2"
    source = "Haddadin, De Luca, Albu-Schaeffer 2017, section IV"
    signature = "in one stretch of time only, and not again when the motion is repeated"
    rivals = ("dropped_samples", "torque_saturation")
    contains = ()
    experiment = "repeat the run with nothing and nobody near the arm"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """None: the stretch of time is found in the residual."""
        return []

    def at(self, joints: tuple[int, ...], log: int, start_s: float, end_s: float) -> Hypothesis:
        """The hypothesis of a push on some joints, in one log, between two times."""
        names = tuple(Coefficient(f"torque_{j + 1}", "N m") for j in joints)
        settings = {"log": float(log), "start": start_s, "end": end_s}
        return Hypothesis(self.id, joints, joints, names, settings)

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """One inside the stretch, for each joint; the caller picks the log."""
        s = hypothesis.settings
        inside = (seen.t >= s["start"]) & (seen.t < s["end"])
        return inside[:, None, None] * np.eye(len(hypothesis.joints))

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A torque between two times."""
        s = hypothesis.settings
        items = [
            Term(_push, j, (float(v), s["start"], s["end"]))
            for j, v in zip(hypothesis.joints, values, strict=True)
        ]
        return replace(arm, terms=(*arm.terms, *items))


EFFECT = Contact()
