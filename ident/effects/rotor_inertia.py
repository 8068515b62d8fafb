"""Reflected inertia of a rotor."""

from dataclasses import replace

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class RotorInertia:
    """tau = .. + Ir qdd."""

    id = "rotor_inertia"
    title = "inertia of the motor's rotor, seen through the gear"
    equation = "tau_j += I_r qdd_j"
    source = "Khalil, Dombre 2002, eq. (9.13)"
    signature = "proportional to the joint's own acceleration, in every pose"
    rivals = ("coupled_inertia", "joint_elasticity")
    contains = ()
    experiment = "accelerate the joint alone, in poses where the links' inertia differs much"
    compares = False
    freedom = FormUncertainty.NONE
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint."""
        inertia = (Coefficient("inertia", "kg m^2", lower=0.0),)
        return [Hypothesis(self.id, (j,), (j,), inertia) for j in arm.moving_joints]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """The joint's acceleration."""
        return seen.qdd[:, hypothesis.joints[0]][:, None, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """An entry on the mass matrix's diagonal."""
        armature = arm.armature.copy()
        armature[hypothesis.joints[0], hypothesis.joints[0]] += values[0]
        return replace(arm, armature=armature)


EFFECT = RotorInertia()
