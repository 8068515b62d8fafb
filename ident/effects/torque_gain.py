"""A drive that gives more or less torque than it is asked for."""

from dataclasses import replace

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Value
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm


class TorqueGain:
    """(1 + e) tau = model; fitted as tau = (1 + s) model."""

    id = "torque_gain"
    title = "a wrong torque constant or gear ratio"
    equation = "(1 + e) tau_j = tau_model,j: the drive gives 1 + e of what it is asked for"
    source = "Gautier, Briot 2011, eq. (9)"
    signature = "in proportion to the joint's whole torque, and on no other joint"
    rivals = ("load_dependent_friction",)
    contains = ()
    experiment = "the same motion with a known payload"
    compares = False
    freedom = FormUncertainty.NONE
    smooth = True
    uses = ("model",)
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint."""
        error = (Coefficient("error", "1", lower=-0.4, upper=0.4),)
        return [Hypothesis(self.id, (j,), (j,), error) for j in arm.moving_joints]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """The joint's rigid-body torque; friction's own parameters absorb friction's share."""
        return seen.load[:, hypothesis.joints[0]][:, None, None]

    def restated(self, hypothesis: Hypothesis, values: dict[str, Value]) -> dict[str, Value]:
        """The error of what the drive gives, not of what it was asked for."""
        more = values["error"]
        gain = 1.0 / (1.0 + more.value)
        return {"error": Value(gain - 1.0, more.sd * gain**2, "1")}

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A drive that gives another share of the command, in which friction was fitted."""
        j = hypothesis.joints[0]
        gain, viscous, coulomb = arm.gain.copy(), arm.viscous.copy(), arm.coulomb.copy()
        gain[j] /= 1.0 + values[0]
        viscous[j] /= 1.0 + values[0]
        coulomb[j] /= 1.0 + values[0]
        return replace(arm, gain=gain, viscous=viscous, coulomb=coulomb)


EFFECT = TorqueGain()
