"""Reflected inertia of a rotor."""

from dataclasses import replace

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import Observed
from ident.simulation.arm import SimulatedArm


class RotorInertia(Effect):
    """tau = .. + Ir qdd."""

    id = "rotor_inertia"
    title = "inertia of the motor's rotor, seen through the gear"
    equation = "tau_j += inertia qdd_j"
    source = "Khalil, Dombre 2002, eq. (9.13)"
    signature = "proportional to the joint's own acceleration, in every pose"
    rivals = ("coupled_inertia", "joint_elasticity")
    experiment = "accelerate the joint alone, in poses where the links' inertia differs much"
    motion = ExperimentMotion.FAST_REVERSALS
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    usual_term = "rotor_inertia"
    linear = (Coefficient("inertia", "kg m^2", lower=0.0),)

    def columns(self, seen: Observed, candidate: Candidate) -> Array:
        """The joint's acceleration."""
        return seen.qdd[:, candidate.joints[0]][:, None, None]

    def simulated(self, arm: SimulatedArm, candidate: Candidate, values: Array) -> SimulatedArm:
        """An entry on the mass matrix's diagonal."""
        armature = arm.armature.copy()
        armature[candidate.joints[0], candidate.joints[0]] += values[0]
        return replace(arm, armature=armature)


EFFECT = RotorInertia()
