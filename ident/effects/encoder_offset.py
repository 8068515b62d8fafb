"""A joint zero that is not where the model has it."""

from dataclasses import replace

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class EncoderOffset:
    """q = q_read + dq."""

    id = "encoder_offset"
    title = "an error of the joint's zero position"
    equation = "q_j = q_read,j + dq"
    source = "the torque of (1), differentiated by q_j"
    signature = "gravity of this joint and all below it, as if the pose were another"
    rivals = ("gravity_tilt", "joint_spring")
    contains = ()
    experiment = "all joints over their whole range; better, a kinematic calibration"
    loads_link = True
    compares = False
    freedom = FormUncertainty.NONE
    smooth = True
    uses = ("model",)
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint; every joint's torque changes."""
        rows = tuple(range(arm.dof))
        offset = (Coefficient("offset", "rad", lower=-0.35, upper=0.35),)
        return [Hypothesis(self.id, (j,), rows, offset) for j in arm.moving_joints]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the joint's position."""
        return seen.slopes(hypothesis.joints[0]).position[:, :, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """An encoder that reads less."""
        zero = arm.zero.copy()
        zero[hypothesis.joints[0]] += values[0]
        return replace(arm, zero=zero)


EFFECT = EncoderOffset()
