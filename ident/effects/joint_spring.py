"""Cable harness or return spring."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import Observed
from ident.simulation.arm import SimulatedArm, Term, term

_SOFT = 1e-9  # N m/rad
_HARDENING = Coefficient("hardening", "N m/rad^3")


class _Shape(NamedTuple):
    """Where a spring rests that hardens with the distance from there [rad]; None: it does not."""

    rest: float | None = None


@term
def _spring(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0] * q[joint] + settings[1]


@term
def _hardening(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0] * (q[joint] - settings[1]) ** 3


class JointSpring(Effect[_Shape]):
    """tau = .. + k (q - q0)."""

    id = "joint_spring"
    title = "a spring on the joint, such as a cable bundle that is bent"
    equation = "tau_j += stiffness q_j + torque_at_zero, or + hardening (q_j - q_rest)^3 too"
    source = "Hooke's law about a rest position -torque_at_zero / stiffness"
    signature = "grows with the joint's angle, the same in both directions"
    rivals = ("torque_offset", "gravity_tilt", "encoder_offset")
    contains = ("torque_offset",)
    experiment = "move the joint alone over more than 2 rad, slowly, in several poses of the others"
    motion = ExperimentMotion.WIDE_SWEEP
    acts_on_link = True
    form_uncertainty = FormUncertainty.POSITION
    band_limited = True
    linear = (
        Coefficient("stiffness", "N m/rad", lower=0.0, defining=True),
        Coefficient("torque_at_zero", "N m"),
    )
    Parameters = _Shape

    def coefficients(self, parameters: _Shape, variant: str) -> tuple[Coefficient, ...]:
        """Stiffness and torque at zero; hardening where it is asked for."""
        return self.linear if parameters.rest is None else (*self.linear, _HARDENING)

    def columns(self, seen: Observed, candidate: Candidate[_Shape]) -> Array:
        """The joint's angle, and ones."""
        q = seen.q[:, candidate.joints[0]]
        columns = [q, np.ones_like(q)]
        if candidate.parameters.rest is not None:
            columns.append((q - candidate.parameters.rest) ** 3)
        return np.stack(columns, axis=-1)[:, None, :]

    def alternative_form(self, candidate: Candidate[_Shape], values: Array) -> Candidate[_Shape]:
        """A spring that hardens or softens with the distance from where it rests."""
        rest = -float(values[1]) / max(float(values[0]), _SOFT)
        return self.moved(candidate, {"rest": float(np.clip(rest, -np.pi, np.pi))})

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Shape], values: Array
    ) -> SimulatedArm:
        """A spring, and by itself what it hardens."""
        j, (stiffness, torque) = candidate.joints[0], (float(values[0]), float(values[1]))
        text = f"{stiffness!r} * q[{j}] + {torque!r}"
        arm = arm.with_terms(Term(_spring, j, (stiffness, torque), ((j, text),)))
        rest = candidate.parameters.rest
        if rest is None:
            return arm
        more = float(values[2])
        text = f"{more!r} * pow(q[{j}] - {rest!r}, 3.0)"
        return arm.with_terms(Term(_hardening, j, (more, rest), ((j, text),)))


EFFECT = JointSpring()
