"""A joint zero that is not where the model has it."""

from dataclasses import replace

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class EncoderOffset(Effect):
    """q = q_read + dq."""

    id = "encoder_offset"
    title = "an error of the joint's zero position"
    equation = "q_j = q_read,j + offset"
    source = "the torque of (1), differentiated by q_j"
    signature = "gravity of this joint and all below it, as if the pose were another"
    rivals = ("gravity_tilt", "joint_spring")
    intervention = (
        "find the zero again with the arm in its home pose, and record the same motion again"
    )
    experiment = "all joints over their whole range; better, a kinematic calibration"
    motion = ExperimentMotion.WIDE_SWEEP
    acts_on_link = True
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    linear = (Coefficient("offset", "rad", lower=-0.35, upper=0.35),)
    depends_on = ("model",)

    def candidates(self, arm: ArmFacts) -> list[Candidate]:
        """One for each joint; every joint's torque changes."""
        return [self.at((j,), rows=range(arm.dof)) for j in arm.moving_joints]

    def columns(self, seen: Observed, candidate: Candidate) -> Array:
        """Change of the torque with the joint's position."""
        return seen.slopes(candidate.joints[0]).position[:, :, None]

    def simulated(self, arm: SimulatedArm, candidate: Candidate, values: Array) -> SimulatedArm:
        """An encoder that reads less."""
        offset = arm.encoder_zero.copy()
        offset[candidate.joints[0]] += values[0]
        return replace(arm, encoder_zero=offset)


EFFECT = EncoderOffset()
