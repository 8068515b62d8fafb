"""Rotor inertia of motors that drive two joints at once."""

from dataclasses import replace

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NoParameters
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_COUPLING = Coefficient("coupling", "kg m^2", defining=True)
_OWN = tuple(Coefficient(f"own_{s}", "kg m^2", lower=0.0) for s in "ab")
_FORMS = {"coupling": (_COUPLING,), "coupling and own": (_COUPLING, *_OWN)}


class CoupledInertia(Effect):
    """tau_i = .. + Ic qdd_j, tau_j = .. + Ic qdd_i."""

    id = "coupled_inertia"
    title = "inertia of a motor's rotor that two joints share"
    equation = "tau_i += coupling qdd_j + own_a qdd_i, tau_j += coupling qdd_i + own_b qdd_j"
    source = "T^T I T of the shared motors' speed T qd: its entry off the diagonal"
    signature = "proportional to the acceleration of the other joint of the pair, in every pose"
    rivals = ("rotor_inertia",)
    contains = ("rotor_inertia",)
    experiment = "accelerate both joints of the pair together, in step and against each other"
    motion = ExperimentMotion.CHANGING_DOMINANCE
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    acts_on_pairs = True

    def candidates(self, arm: ArmFacts) -> list[Candidate]:
        """One for each pair: the coupling alone, or with what it adds to either joint."""
        return [self.at(pair, variant=form) for pair in arm.coupled_pairs for form in _FORMS]

    def coefficients(self, parameters: NoParameters, variant: str) -> tuple[Coefficient, ...]:
        """The coupling, and what it adds to each joint."""
        return _FORMS[variant]

    def columns(self, seen: Observed, candidate: Candidate) -> Array:
        """Accelerations, crosswise; then each joint's own."""
        qdd = seen.qdd[:, list(candidate.joints)]
        columns = np.zeros((*qdd.shape, len(candidate.coefficients)))
        columns[:, :, 0] = qdd[:, ::-1]
        for k in range(1, len(candidate.coefficients)):
            columns[:, k - 1, k] = qdd[:, k - 1]
        return columns

    def simulated(self, arm: SimulatedArm, candidate: Candidate, values: Array) -> SimulatedArm:
        """Entries of the mass matrix."""
        a, b = candidate.joints
        armature = arm.armature.copy()
        armature[[a, b], [b, a]] += values[0]
        for joint, own in zip((a, b), values[1:], strict=False):
            armature[joint, joint] += own
        return replace(arm, armature=armature)


EFFECT = CoupledInertia()
