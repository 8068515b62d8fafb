"""A transmission that gives."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import ExperimentMotion
from ident.effects.motor_link import MIN_INERTIA, MotorLink, Transmission, mass_in
from ident.effects.observation import ArmFacts

_SWINGS_HZ = (6.0, 12.0, 40.0)  # of a link whose motor is held; softer is a lag by another name
_MOTOR = 0.1  # of the joint's inertia: a motor's; it hardly matters


class _Spring(NamedTuple):
    """Compliance [rad/(N m)], friction on the link, damping, inertia of the motor [kg m^2]."""

    give: float
    rubbing: float
    damped: float
    motor_inertia: float


class JointElasticity(MotorLink[_Spring]):
    """tau_link = K (q_motor - q_link)."""

    id = "joint_elasticity"
    title = "a transmission that gives under load"
    equation = "q_j - q_link,j = compliance tau_link,j"
    source = "Spong 1987, eq. (6)"
    signature = "gravity and inertia as if the pose were another, in step with the joint's own load"
    rivals = ("encoder_offset", "torque_delay", "rotor_inertia")
    intervention = "clamp the link, and let the motor push against it with a known torque"
    experiment = "a chirp up to 50 Hz; an encoder on the joint's side"
    motion = ExperimentMotion.FAST_REVERSALS
    depends_on = ("model", "friction")
    same_number = ("compliance", "give")
    linear = (Coefficient("compliance", "rad/(N m)", lower=0.0),)
    Parameters = _Spring
    nonlinear = (
        NonlinearParameter(
            "give", "rad/(N m)", (1e-4, 4e-4, 1.6e-3), 1e-7, 1.0, is_parameter=False
        ),
        NonlinearParameter(
            "rubbing",
            "1",
            (0.0, 0.5, 1.0),
            0.0,
            1.0,
            linear_grid=True,
            refine_only=True,
            is_parameter=False,
        ),
        NonlinearParameter(
            "damped", "1", (0.1, 0.4), 0.01, 0.4, refine_only=True, is_parameter=False
        ),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Spring]]:
        """One for each joint and frequency at which its link swings; all torques change."""
        mass = np.diag(mass_in(arm.pose, arm.chain, arm.delta))
        damped = self.nonlinear[2].grid[-1]
        found = []
        for j in arm.moving_joints:
            inertia = max(float(mass[j]), MIN_INERTIA)
            for swing in _SWINGS_HZ:
                softness = 1.0 / (inertia * (2 * np.pi * swing) ** 2)
                shape = _Spring(softness, 0.0, damped, _MOTOR * inertia)
                found.append(self.at((j,), shape, rows=range(arm.dof)))
        return found

    def tie(self, parameters: _Spring, size: float) -> Transmission:
        """A spring without stops."""
        return Transmission(
            np.inf, size, parameters.damped, parameters.rubbing, parameters.motor_inertia
        )


EFFECT = JointElasticity()
