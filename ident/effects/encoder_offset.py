"""A joint zero that is not where the model has it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.dynamics.compiled_chain import torques
from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_LARGEST = 0.8
"""[rad] More than a turn of the WAM's wrist motors makes at their joints (0.65)."""

_LINEAR = 1e-3
"""[rad] Offsets up to which the torque's slope is as good as its chord."""


class _About(NamedTuple):
    """Offset whose chord the torque is taken along [rad]."""

    about: float = 0.0


class EncoderOffset(Effect[_About]):
    """q = q_read + dq."""

    id = "encoder_offset"
    title = "an error of the joint's zero position"
    equation = "q_j = q_read,j + offset"
    source = "the torque of (1) at the true position less that at the one that was read"
    signature = "gravity of this joint and all below it, as if the pose were another"
    rivals = ("gravity_tilt", "joint_spring")
    intervention = (
        "find the zero again with the arm in its home pose, and record the same motion again"
    )
    experiment = "all joints over their whole range; better, a kinematic calibration"
    motion = ExperimentMotion.WIDE_SWEEP
    acts_on_link = True
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    linear_in_coefficients = False
    linear = (Coefficient("offset", "rad", lower=-_LARGEST, upper=_LARGEST),)
    Parameters = _About
    nonlinear = (
        NonlinearParameter(
            "about", "rad", (0.0,), -_LARGEST, _LARGEST, linear_grid=True, is_parameter=False
        ),
    )
    depends_on = ("model",)

    def candidates(self, arm: ArmFacts) -> list[Candidate[_About]]:
        """One for each joint; every joint's torque changes."""
        return [self.at((j,), _About(), rows=range(arm.dof)) for j in arm.moving_joints]

    def linearised_at(self, candidate: Candidate[_About], values: Array) -> Candidate[_About]:
        """Along the chord of an offset, which is then exact."""
        about = float(np.clip(values[0], -_LARGEST, _LARGEST))
        return replace(candidate, parameters=_About(about))

    def columns(self, seen: Observed, candidate: Candidate[_About]) -> Array:
        """Change of the torque with the joint's position."""
        (joint,), about = candidate.joints, candidate.parameters.about
        if abs(about) < _LINEAR:
            return seen.slopes(joint).position[:, :, None]
        q = seen.q.copy()
        q[:, joint] += about
        moved = torques(seen.arm.chain, seen.arm.delta, q, seen.qd, seen.qdd)
        return (moved - seen.load)[:, :, None] / about

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_About], values: Array
    ) -> SimulatedArm:
        """An encoder that reads less."""
        offset = arm.encoder_zero.copy()
        offset[candidate.joints[0]] += values[0]
        return replace(arm, encoder_zero=offset)


EFFECT = EncoderOffset()
