"""Torque that acts later (or earlier) than the log says."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_LEAST_S = 0.0008  # less is within what holding and differentiating leave
_SHORT_S = 0.004  # the columns of shorter delays are alike
_FAR = 1.6  # times: what the columns about one delay still describe


class TorqueDelay:
    """model(t) = tau(t - d)."""

    id = "torque_delay"
    title = "a delay between torque and position"
    equation = "tau_model(t) = tau(t - d)"
    source = (
        "pure delay; a current loop's lag and a time shift of the log look the same below 10 Hz"
    )
    signature = "in proportion to the rate of change of the torque"
    rivals = ("rotor_inertia", "joint_elasticity")
    contains = ()
    experiment = "fast torque changes: a chirp, or motion with many reversals"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = False
    uses = ("torque",)
    settings = (
        Setting(
            "about", "s", (-0.01, -0.004, 0.002, 0.004, 0.01, 0.02), -0.05, 0.05, reported=False
        ),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """All joints alike, and each joint alone, about several delays."""
        places = [arm.moving_joints, *((j,) for j in arm.moving_joints)]
        return [
            Hypothesis(self.id, joints, joints, self.coefficients({"about": d}), {"about": d})
            for joints in dict.fromkeys(places)
            for d in self.settings[0].grid
        ]

    def coefficients(self, settings: dict[str, float]) -> tuple[Coefficient, ...]:
        """The delay, of the size about which the columns are formed: else they smooth the torque.

        A smoothed torque imitates inertia where friction is most of it.
        """
        about = settings["about"]
        least = 0.0 if abs(about) <= _SHORT_S else about / _FAR
        lower, upper = sorted((least, _FAR * about))
        return (Coefficient("delay", "s", lower, upper, least=_LEAST_S),)

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """(tau(t) - tau(t - d)) / d: exact when the coefficient comes out as d.

        Of the model's torque, where it was measured: (model(t + d) - model(t)) / d.
        """
        d = hypothesis.settings["about"]
        step = -d if seen.arm.commanded else d
        columns = []
        for j in hypothesis.joints:
            tau = seen.tau[:, j]
            columns.append((np.interp(seen.t + step, seen.t, tau) - tau) / step)
        return np.stack(columns, axis=-1)[:, :, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """Commands that act later."""
        delay = arm.delay_s.copy()
        delay[list(hypothesis.joints)] += values[0]
        return replace(arm, delay_s=delay)


EFFECT = TorqueDelay()
