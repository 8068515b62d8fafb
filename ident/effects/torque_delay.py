"""Torque that acts later (or earlier) than the log says."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_LEAST_S = 0.0008  # less is within what holding and differentiating leave
_SHORT_S = 0.004  # the columns of shorter delays are alike
_FAR = 1.6  # times: what the columns about one delay still describe


class _Delay(NamedTuple):
    """The delay about which the columns are formed [s]."""

    about: float


class TorqueDelay(Effect[_Delay]):
    """model(t) = tau(t - d)."""

    id = "torque_delay"
    title = "a delay between torque and position"
    equation = "tau_model(t) = tau(t - delay)"
    source = (
        "pure delay; a current loop's lag and a time shift of the log look the same below 10 Hz"
    )
    signature = "in proportion to the rate of change of the torque"
    rivals = ("rotor_inertia", "joint_elasticity")
    intervention = "clamp the link, and record the answer to small steps of torque"
    experiment = "fast torque changes: a chirp, or motion with many reversals"
    motion = ExperimentMotion.FAST_REVERSALS
    depends_on = ("torque",)
    has_memory = True
    Parameters = _Delay
    nonlinear = (
        NonlinearParameter(
            "about", "s", (-0.01, -0.004, 0.002, 0.004, 0.01, 0.02), -0.05, 0.05, is_parameter=False
        ),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Delay]]:
        """All joints alike, and each joint alone, about several delays.

        No command acts before it is given: positions that are read late, which look so, are late
        at all joints.
        """
        whole = arm.moving_joints
        places = dict.fromkeys([whole, *((j,) for j in whole)])
        return [
            self.at(joints, _Delay(d))
            for joints in places
            for d in self.nonlinear[0].grid
            if d > 0.0 or joints == whole or not arm.commanded
        ]

    def coefficients(self, parameters: _Delay, variant: str) -> tuple[Coefficient, ...]:
        """The delay, of the size about which the columns are formed: else they smooth the torque.

        A smoothed torque imitates inertia where friction is most of it.
        """
        about = parameters.about
        smallest = 0.0 if abs(about) <= _SHORT_S else about / _FAR
        lower, upper = sorted((smallest, _FAR * about))
        return (Coefficient("delay", "s", lower, upper, min_size=_LEAST_S),)

    def columns(self, seen: Observed, candidate: Candidate[_Delay]) -> Array:
        """(tau(t) - tau(t - d)) / d: exact when the coefficient comes out as d.

        Of the model's torque, where it was measured: (model(t + d) - model(t)) / d.
        """
        d = candidate.parameters.about
        step = -d if seen.arm.commanded else d
        columns = []
        for j in candidate.joints:
            tau = seen.tau[:, j]
            columns.append((np.interp(seen.t + step, seen.t, tau) - tau) / step)
        return np.stack(columns, axis=-1)[:, :, None]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Delay], values: Array
    ) -> SimulatedArm:
        """Commands that act later."""
        delay = arm.delay_s.copy()
        delay[list(candidate.joints)] += values[0]
        return replace(arm, delay_s=delay)


EFFECT = TorqueDelay()
