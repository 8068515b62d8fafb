"""Play in the transmission."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import (
    ArmFacts,
    Array,
    Coefficient,
    Freedom,
    Hypothesis,
    Observed,
    Setting,
)
from ident.simulation.arm import SimulatedArm


class Backlash:
    """q_link = q_motor - b sgn(load)."""

    id = "backlash"
    title = "play in the transmission"
    equation = "q_link,j = q_j - b sgn(tau_rigid,j), crossed at a finite rate"
    source = "Nordin, Gutman 2002, section 2: the dead zone's two contact sides"
    signature = "steps where the transmitted torque, not the speed, changes its sign"
    rivals = ("presliding", "encoder_offset")
    contains = ()
    experiment = "torque that changes sign without a change of speed, as through a gravity crossing"
    compares = False
    freedom = Freedom.ANY
    smooth = True
    uses = ("model",)
    settings = (Setting("crossing_share", "1", (0.02, 0.06, 0.2), 0.005, 0.5, reported=False),)

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint and width of the crossing; every joint's torque changes."""
        rows = tuple(range(arm.dof))
        half = (Coefficient("half_play", "rad", lower=0.0),)
        return [
            Hypothesis(self.id, (j,), rows, half, {"crossing_share": s})
            for j in arm.moving_joints
            for s in self.settings[0].grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the side that carries the load."""
        j = hypothesis.joints[0]
        load = seen.load[:, j]
        width = hypothesis.settings["crossing_share"] * max(float(np.abs(load).max()), 1e-9)
        side = np.tanh(load / width)
        rate = np.gradient(side, 1.0 / seen.rate_hz)
        change = np.gradient(rate, 1.0 / seen.rate_hz)
        return -seen.slopes(j).times(side, rate, change)[:, :, None]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """An encoder that reads the side that carries the load too."""
        slack = arm.slack.copy()
        slack[hypothesis.joints[0]] += values[0]
        return replace(arm, slack=slack)


EFFECT = Backlash()
