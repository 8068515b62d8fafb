"""Constant torque offset; moving data cannot tell it from direction-dependent Coulomb friction."""

import numpy as np

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import Observed
from ident.simulation.arm import SimulatedArm, Term, constant_torque


class TorqueOffset(Effect):
    """tau = .. + c."""

    id = "torque_offset"
    title = "a constant extra torque (sensor offset, or friction that differs by direction)"
    equation = "tau_j += offset"
    source = "Gautier 1986; current-sensor bias of the drive"
    signature = "the same in both directions, at all speeds and poses"
    rivals = ("joint_spring", "gravity_tilt")
    experiment = "move the joint to and fro at constant speed over its whole range"
    motion = ExperimentMotion.WIDE_SWEEP
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    usual_term = "offset"
    linear = (Coefficient("offset", "N m"),)

    def columns(self, seen: Observed, candidate: Candidate) -> Array:
        """Ones."""
        return np.ones((len(seen.t), 1, 1))

    def simulated(self, arm: SimulatedArm, candidate: Candidate, values: Array) -> SimulatedArm:
        """A constant torque."""
        j, offset = candidate.joints[0], float(values[0])
        return arm.with_terms(Term(constant_torque, j, (offset,), ((j, f"{offset!r}"),)))


EFFECT = TorqueOffset()
