"""Play in the transmission."""

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
from ident.effects.motor_link import LIGHT, Transmission, mass_in
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_MOTOR = 0.1  # of the joint's inertia: a motor's, at first


class Backlash:
    """q_link = q_motor + y, |y| <= b, free in between."""

    id = "backlash"
    title = "play in the transmission"
    equation = "q_link,j = q_j + y, |y| <= b; tau_link,j = 0 for |y| < b, else it pushes"
    source = "Nordin, Gutman 2002, section 2: dead zone, rigid contact on both sides, no rebound"
    signature = (
        "no torque while the link crosses the play, a blow at its end, where the transmitted "
        "torque, not the speed, changes its sign"
    )
    rivals = ("presliding", "encoder_offset")
    contains = ()
    experiment = "torque that changes sign without a change of speed, as through a gravity crossing"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = True
    uses = ("model", "friction", "torque")
    twice = ("half_play", "play")
    settings = (
        Setting("play", "rad", (5e-4, 1e-3, 2e-3, 4e-3, 8e-3), 2e-4, 0.03, reported=False),
        Setting("rubbing", "1", (0.0, 0.25, 0.5, 0.75, 1.0), 0.0, 1.0, even=True, reported=False),
        Setting("motor_inertia", "kg m^2", (1e-3, 4e-3), 1e-7, 10.0, late=True, reported=False),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint, half play and part of the friction that is rubbed by the link."""
        rows, mass = tuple(range(arm.dof)), np.diag(mass_in(arm.pose, arm.chain, arm.delta))
        half = (Coefficient("half_play", "rad", lower=0.0),)
        motor = np.maximum(_MOTOR * mass, LIGHT)
        play, rubbing, inertia = self.settings
        return [
            Hypothesis(
                self.id,
                (j,),
                rows,
                half,
                {play.name: b, rubbing.name: part, inertia.name: float(motor[j])},
            )
            for j in arm.moving_joints
            for part in rubbing.grid
            for b in play.grid
        ]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the link's motion in the play, per half play."""
        play = hypothesis.settings["play"]
        return _tie(hypothesis, play).change(seen, hypothesis.joints[0])[:, :, None] / play

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A motor of its own, with the encoder, that carries the joint within the play."""
        return _tie(hypothesis, float(values[0])).between(arm, hypothesis.joints[0])


def _tie(hypothesis: Hypothesis, half_play: float) -> Transmission:
    shape = hypothesis.settings
    return Transmission(half_play, 0.0, 0.0, shape["rubbing"], shape["motor_inertia"])


EFFECT = Backlash()
