"""A transmission that gives."""

from dataclasses import replace

from ident.effects.effect import ArmFacts, Array, Coefficient, Freedom, Hypothesis, Observed
from ident.effects.slope import rates
from ident.simulation.arm import SimulatedArm


class JointElasticity:
    """q_link = q_motor - tau / K."""

    id = "joint_elasticity"
    title = "a transmission that gives under load"
    equation = "q_link,j = q_j - tau_j / K"
    source = "Spong 1987, eq. (6), quasi-static below the resonance"
    signature = "gravity and inertia as if the pose were another, in step with the joint's own load"
    rivals = ("encoder_offset", "torque_delay", "rotor_inertia")
    contains = ()
    experiment = "a chirp up to 50 Hz; an encoder on the joint's side"
    compares = False
    freedom = Freedom.ANY
    smooth = True
    uses = ("model",)
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint; every joint's torque changes."""
        rows = tuple(range(arm.dof))
        give = (Coefficient("compliance", "rad/(N m)", lower=0.0),)
        return [Hypothesis(self.id, (j,), rows, give) for j in arm.moving_joints]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the transmission's wind-up and its rates."""
        j = hypothesis.joints[0]
        load = seen.load[:, j]
        rate, change = rates(load, 1.0 / seen.rate_hz)
        return -seen.slopes(j).times(load, rate, change)[:, :, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """An encoder that reads the wind-up too."""
        give = arm.give.copy()
        give[hypothesis.joints[0]] += values[0]
        return replace(arm, give=give)


EFFECT = JointElasticity()
