"""Backlash in the transmission."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import ExperimentMotion
from ident.effects.motor_link import MIN_INERTIA, MotorLink, Transmission, mass_in
from ident.effects.observation import ArmFacts

_MOTOR = 0.1  # of the joint's inertia: a motor's, at first


class _Play(NamedTuple):
    """Half the play [rad], part of the friction on the link, inertia of the motor [kg m^2]."""

    play: float
    rubbing: float
    motor_inertia: float


class Backlash(MotorLink[_Play]):
    """q_link = q_motor + y, |y| <= b, free in between."""

    id = "backlash"
    title = "backlash in the transmission"
    equation = (
        "q_link,j = q_j + y, |y| <= half_play (half the backlash); tau_link,j = 0 for"
        " |y| < half_play, else it pushes"
    )
    source = "Nordin, Gutman 2002, section 2: dead zone, rigid contact on both sides, no rebound"
    signature = (
        "no torque while the link crosses the gap, a blow at its end, where the transmitted "
        "torque, not the speed, changes its sign"
    )
    rivals = ("presliding", "encoder_offset")
    intervention = (
        "clamp the link, and turn the motor by hand from one end of the backlash to the other"
    )
    experiment = "torque that changes sign without a change of speed, as through a gravity crossing"
    motion = ExperimentMotion.SLOW_REVERSALS
    depends_on = ("model", "friction", "torque")
    same_number = ("half_play", "play")
    linear = (Coefficient("half_play", "rad", lower=0.0),)
    Parameters = _Play
    nonlinear = (
        NonlinearParameter(
            "play", "rad", (5e-4, 1e-3, 2e-3, 4e-3, 8e-3), 2e-4, 0.03, is_parameter=False
        ),
        NonlinearParameter(
            "rubbing",
            "1",
            (0.0, 0.25, 0.5, 0.75, 1.0),
            0.0,
            1.0,
            linear_grid=True,
            is_parameter=False,
        ),
        NonlinearParameter(
            "motor_inertia",
            "kg m^2",
            (1e-3, 4e-3),
            1e-7,
            10.0,
            refine_only=True,
            is_parameter=False,
        ),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Play]]:
        """One for each joint, half play and part of the friction that is rubbed by the link."""
        mass = np.diag(mass_in(arm.pose, arm.chain, arm.delta))
        motor = np.maximum(_MOTOR * mass, MIN_INERTIA)
        play, rubbing, _ = self.nonlinear
        return [
            self.at((j,), _Play(b, part, float(motor[j])), rows=range(arm.dof))
            for j in arm.moving_joints
            for part in rubbing.grid
            for b in play.grid
        ]

    def tie(self, parameters: _Play, size: float) -> Transmission:
        """Two stops, and nothing between them."""
        return Transmission(size, 0.0, 0.0, parameters.rubbing, parameters.motor_inertia)


EFFECT = Backlash()
