"""A drive that clips the torque below what it is asked for."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting, Value
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_MOST = 0.3  # share of the samples: what is clipped more often is the joint's usual torque
_SHARES = (
    *(round(0.05 * 1.17**k, 3) for k in range(17)),
    *(0.69, 0.75, 0.8, 0.84, 0.875, 0.905, 0.93, 0.95, 0.965, 0.978, 0.988),
)
_NOT_ALL = 0.1  # so much more or less than all that is beyond the limit: no limit


class TorqueSaturation:
    """model = clip(tau, -limit, limit)."""

    id = "torque_saturation"
    title = "torque that the drive clips"
    equation = "tau_model,j = max(-limit, min(limit, tau_j))"
    source = "current limit of the drive"
    signature = "only where the commanded torque is large, and always on the same side"
    rivals = ("contact", "torque_gain")
    contains = ()
    experiment = "motion that stays below half of the torque at which the residual begins"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = False
    uses = ("torque",)
    settings = (Setting("limit_share", "1", _SHARES, 0.05, 0.999),)

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint and limit, as a share of the largest command."""
        clipped = (Coefficient("clipped_share", "1", lower=0.5, upper=1.5),)
        return [
            Hypothesis(
                self.id, (j,), (j,), clipped, {"limit_share": s, "peak": float(arm.peak_torque[j])}
            )
            for j in arm.moving_joints
            for s in self.settings[0].grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """The part of the command beyond the limit, where that is passed now and then."""
        limit = hypothesis.settings["limit_share"] * hypothesis.settings["peak"]
        tau = seen.tau[:, hypothesis.joints[0]]
        beyond = tau - np.clip(tau, -limit, limit)
        often = np.mean(beyond != 0.0) > _MOST
        return (beyond * (0.0 if often else 1.0))[:, None, None]

    def makes_sense(self, hypothesis: Hypothesis, values: Array) -> bool:
        """Of what is beyond the limit, all is cut off."""
        return abs(float(values[0]) - 1.0) < _NOT_ALL

    def restated(self, hypothesis: Hypothesis, values: dict[str, Value]) -> dict[str, Value]:
        """The limit itself."""
        peak = hypothesis.settings["peak"]
        share = values.get("limit_share") or Value(hypothesis.settings["limit_share"], 0.0, "1")
        limit = Value(share.value * peak, share.sd * peak, "N m")
        return {"limit": limit, "clipped_share": values["clipped_share"]}

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A lower limit of the drive."""
        limit = arm.limit.copy()
        share, peak = hypothesis.settings["limit_share"], hypothesis.settings["peak"]
        j = hypothesis.joints[0]
        limit[j] = min(limit[j], share * peak)
        return replace(arm, limit=limit)


EFFECT = TorqueSaturation()
