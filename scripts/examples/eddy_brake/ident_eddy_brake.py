"""An effect of one's own: the drag of an eddy-current brake, which is strongest at one speed."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


class Brake(NamedTuple):
    """What shapes the columns: the speed at which the brake is strongest [rad/s]."""

    speed: float


@term
def _brake(t, q, qd, load, joint, settings, resistance, level):
    ratio = qd[joint] / settings[1]
    resistance[joint] += settings[0] * 2.0 * ratio / (1.0 + ratio**2)


class EddyBrake(Effect[Brake]):
    """tau = .. + 2 F (qd/v) / (1 + (qd/v)^2)."""

    id = "eddy_brake"
    title = "the drag of an eddy-current brake"
    equation = "tau_j += 2 peak_torque (qd_j/speed) / (1 + (qd_j/speed)^2)"
    source = "torque over speed of an eddy-current brake: linear at first, its peak at v"
    signature = "follows the direction of motion; rises to a peak with speed, and falls beyond it"
    experiment = "constant speeds up to the joint's limit, evenly spread"
    motion = ExperimentMotion.SPEED_STAIRCASE
    rivals = ("nonlinear_viscous", "stribeck")
    form_uncertainty = FormUncertainty.SPEED
    linear = (Coefficient("peak_torque", "N m", lower=0.0),)
    nonlinear = (NonlinearParameter("speed", "rad/s", (0.2, 0.4, 0.8, 1.6), 0.05, 5.0),)
    Parameters = Brake

    def candidates(self, arm: ArmFacts) -> list[Candidate[Brake]]:
        """One for each joint and speed."""
        grid = self.nonlinear[0].grid
        return [self.at((j,), Brake(speed)) for j in arm.moving_joints for speed in grid]

    def columns(self, seen: Observed, candidate: Candidate[Brake]) -> Array:
        """The drag per peak torque."""
        ratio = seen.qd[:, candidate.joints[0]] / candidate.parameters.speed
        return np.asarray(2.0 * ratio / (1.0 + ratio**2))[:, None, None]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[Brake], values: Array
    ) -> SimulatedArm:
        """The same in the simulation's inner loop."""
        return arm.with_terms(
            Term(_brake, candidate.joints[0], (values[0], candidate.parameters.speed))
        )


EFFECT = EddyBrake()
