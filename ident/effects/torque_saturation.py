"""A drive that clips the torque below what it is asked for."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter, Value
from ident.effects.effect import Array, Effect, ExperimentMotion
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_MOST = 0.3  # share of the samples: what is clipped more often is the joint's usual torque
_SHARES = (
    *(round(0.05 * 1.17**k, 3) for k in range(17)),
    *(0.69, 0.75, 0.8, 0.84, 0.875, 0.905, 0.93, 0.95, 0.965, 0.978, 0.988),
)
_NOT_ALL = 0.1  # so much more or less than all that is beyond the limit: no limit


class _Limit(NamedTuple):
    """The limit as a share of the largest command, and that command [N m]."""

    limit_share: float
    peak: float


class TorqueSaturation(Effect[_Limit]):
    """model = clip(tau, -limit, limit)."""

    id = "torque_saturation"
    title = "torque that the drive clips"
    equation = "tau_model,j = max(-limit, min(limit, tau_j)); beyond it, clipped_share is lost"
    source = "current limit of the drive"
    signature = "only where the commanded torque is large, and always on the same side"
    rivals = ("contact", "torque_gain")
    experiment = "motion that stays below half of the torque at which the residual begins"
    motion = ExperimentMotion.LOAD_CHANGES
    depends_on = ("torque",)
    linear = (Coefficient("clipped_share", "1", lower=0.5, upper=1.5),)
    Parameters = _Limit
    nonlinear = (NonlinearParameter("limit_share", "1", _SHARES, 0.05, 0.999),)

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Limit]]:
        """One for each joint and limit, as a share of the largest command."""
        return [
            self.at((j,), _Limit(s, float(arm.peak_torque[j])))
            for j in arm.moving_joints
            for s in self.nonlinear[0].grid
        ]

    def columns(self, seen: Observed, candidate: Candidate[_Limit]) -> Array:
        """The part of the command beyond the limit, where that is passed now and then."""
        limit = candidate.parameters.limit_share * candidate.parameters.peak
        tau = seen.tau[:, candidate.joints[0]]
        beyond = tau - np.clip(tau, -limit, limit)
        often = np.mean(beyond != 0.0) > _MOST
        return (beyond * (0.0 if often else 1.0))[:, None, None]

    def is_plausible(
        self,
        candidate: Candidate[_Limit],
        values: Array,
        friction: tuple[float, float],
        tuned: bool,
    ) -> bool:
        """Once the limit is tuned, all that is beyond it is cut off, within a tenth."""
        return not tuned or abs(float(values[0]) - 1.0) < _NOT_ALL

    def as_reported(
        self, candidate: Candidate[_Limit], values: dict[str, Value]
    ) -> dict[str, Value]:
        """The limit itself."""
        peak = candidate.parameters.peak
        share = values.get("limit_share") or Value(candidate.parameters.limit_share, 0.0, "1")
        limit = Value(share.value * peak, share.sd * peak, "N m")
        return {"limit": limit} | {n: v for n, v in values.items() if n != "limit_share"}

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Limit], values: Array
    ) -> SimulatedArm:
        """A lower limit of the drive."""
        limit = arm.limit.copy()
        share, peak = candidate.parameters
        j = candidate.joints[0]
        limit[j] = min(limit[j], share * peak)
        return replace(arm, limit=limit)


EFFECT = TorqueSaturation()
