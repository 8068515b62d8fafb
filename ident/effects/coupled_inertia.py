"""Rotor inertia of motors that drive two joints at once."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class CoupledInertia:
    """tau_i = .. + Ic qdd_j, tau_j = .. + Ic qdd_i."""

    id = "coupled_inertia"
    title = "inertia of a motor's rotor that two joints share"
    equation = "tau_i += I_c qdd_j, tau_j += I_c qdd_i"
    source = "T^T I T of the shared motors' speed T qd: its entry off the diagonal"
    signature = "proportional to the acceleration of the other joint of the pair, in every pose"
    rivals = ("rotor_inertia",)
    contains = ("rotor_inertia",)
    experiment = "accelerate both joints of the pair together, in step and against each other"
    compares = False
    freedom = FormUncertainty.NONE
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each pair: the coupling alone, or with what it adds to either joint."""
        cross = Coefficient("coupling", "kg m^2", essential=True)
        own = tuple(Coefficient(f"own_{s}", "kg m^2", lower=0.0) for s in "ab")
        forms = {"coupling": (cross,), "coupling and own": (cross, *own)}
        return [
            Hypothesis(self.id, pair, pair, names, variant=form)
            for pair in arm.coupled_pairs
            for form, names in forms.items()
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Accelerations, crosswise; then each joint's own."""
        qdd = seen.qdd[:, list(hypothesis.joints)]
        columns = np.zeros((*qdd.shape, len(hypothesis.coefficients)))
        columns[:, :, 0] = qdd[:, ::-1]
        for k in range(1, len(hypothesis.coefficients)):
            columns[:, k - 1, k] = qdd[:, k - 1]
        return columns

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """Entries of the mass matrix."""
        a, b = hypothesis.joints
        armature = arm.armature.copy()
        armature[[a, b], [b, a]] += values[0]
        for joint, own in zip((a, b), values[1:], strict=False):
            armature[joint, joint] += own
        return replace(arm, armature=armature)


EFFECT = CoupledInertia()
