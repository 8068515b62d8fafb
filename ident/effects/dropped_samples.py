"""Lost, repeated or shifted samples: a fault of the data, not of the arm."""

import numpy as np

from ident.effects.effect import Array, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class DroppedSamples:
    """No torque: the log is at fault."""

    id = "dropped_samples"
    title = "lost, repeated or shifted samples in the log"
    equation = "q(t_k) stands in the log with another stamp"
    source = "intake check"
    signature = "short spikes in the acceleration of all joints at once"
    rivals = ("contact",)
    contains = ()
    experiment = "record again with a logger that keeps up; compare its counters"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """None: looked for before the model is fitted."""
        return []

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """None."""
        return np.zeros((len(seen.t), 0, 0))

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """The arm as it is."""
        return arm


EFFECT = DroppedSamples()
