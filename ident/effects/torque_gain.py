"""A drive that gives more or less torque than it is asked for."""

from dataclasses import replace

from ident.effects.candidate import Candidate, Coefficient, Value
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import Observed
from ident.simulation.arm import SimulatedArm


class TorqueGain(Effect):
    """(1 + e) tau = model; fitted as tau = (1 + s) model."""

    id = "torque_gain"
    title = "a wrong torque constant or gear ratio"
    equation = "(1 + e) tau_j = tau_model,j: the drive gives 1 + e of what it is asked for"
    source = "Gautier, Briot 2011, eq. (9)"
    signature = "in proportion to the joint's whole torque, and on no other joint"
    rivals = ("load_dependent_friction",)
    experiment = "the same motion with a known payload"
    motion = ExperimentMotion.LOAD_CHANGES
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    scales_torque = True
    linear = (Coefficient("error", "1", lower=-0.4, upper=0.4),)
    depends_on = ("model",)

    def columns(self, seen: Observed, candidate: Candidate) -> Array:
        """The joint's rigid-body torque; friction's own parameters absorb friction's share."""
        return seen.load[:, candidate.joints[0]][:, None, None]

    def as_reported(self, candidate: Candidate, values: dict[str, Value]) -> dict[str, Value]:
        """The error of what the drive gives, not of what it was asked for."""
        more = values["error"]
        gain = 1.0 / (1.0 + more.value)
        return {"error": Value(gain - 1.0, more.sd * gain**2, "1")}

    def simulated(self, arm: SimulatedArm, candidate: Candidate, values: Array) -> SimulatedArm:
        """A drive that gives another share of the command, in which friction was fitted."""
        j = candidate.joints[0]
        gain, viscous, coulomb = arm.gain.copy(), arm.viscous.copy(), arm.coulomb.copy()
        gain[j] /= 1.0 + values[0]
        viscous[j] /= 1.0 + values[0]
        coulomb[j] /= 1.0 + values[0]
        return replace(arm, gain=gain, viscous=viscous, coulomb=coulomb)


EFFECT = TorqueGain()
