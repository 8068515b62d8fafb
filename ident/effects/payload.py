"""A mass at the tool."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import ArmFacts, Array, Coefficient, Freedom, Hypothesis, Observed
from ident.simulation.arm import SimulatedArm
from ident.simulation.regressor import regressor


class Payload:
    """tau = .. + Y_tool (m, m c)."""

    id = "payload"
    title = "a mass at the tool"
    equation = "tau += Y_n(q, qd, qdd) (m, m c), the last link's columns of (6)"
    source = "Khalil, Gautier, Lemoine 2007, eq. (10), mass and first moment only"
    signature = "gravity and inertia on all joints, as if the last link had become heavier"
    rivals = ("encoder_offset", "gravity_tilt")
    contains = ()
    experiment = "the same motion with and without the load"
    loads_link = True
    compares = True
    freedom = Freedom.NONE
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One: all joints feel it."""
        names = (
            Coefficient("mass", "kg", lower=0.0),
            *(Coefficient(f"first_moment_{s}", "kg m") for s in "xyz"),
        )
        return [Hypothesis(self.id, (arm.dof - 1,), tuple(range(arm.dof)), names)]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """The last link's mass and first moment."""
        rows = regressor(seen.arm.chain, seen.q, seen.qd, seen.qdd)
        last = 10 * (seen.arm.dof - 1)
        return rows[:, :, [last + 9, last + 6, last + 7, last + 8]]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A heavier last link, with the tensor of a point mass at the payload's centre."""
        delta = arm.delta.copy()
        mass, first = values[0], np.asarray(values[1:])
        centre = first / mass if mass > 0.0 else np.zeros(3)
        tensor = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        delta[-10:] += np.concatenate([tensor[np.triu_indices(3)], first, [mass]])
        return replace(arm, delta=delta)


EFFECT = Payload()
