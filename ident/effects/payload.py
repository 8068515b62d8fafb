"""A mass at the tool."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.dynamics.compiled_regressor import regressor
from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_FARTHEST_M = 1.0  # of a payload's centre from the last link's frame


_BODY = "rigid body"
_PLACES = [9, 6, 7, 8, *range(6)]  # of mass, first moment and tensor among a link's parameters
_TENSOR = tuple(Coefficient(f"inertia_{s}", "kg m^2") for s in ("xx", "xy", "xz", "yy", "yz", "zz"))


class _Centre(NamedTuple):
    """The centre about which the columns are formed [m]."""

    about_x: float = 0.0
    about_y: float = 0.0
    about_z: float = 0.0


class Payload(Effect[_Centre]):
    """tau = .. + Y_tool (L, m c, m): the tensor L is that of a point mass m at c until it is found.

    From then on it has a tensor of its own: that of a body is larger, and what it leaves of the
    torque would go into the first moment, or be taken for rotors of the wrist.
    """

    id = "payload"
    title = "a mass at the tool"
    equation = (
        "tau += Y_n(q, qd, qdd) (inertia, first_moment, mass), the last link's columns of (6)"
    )
    source = "Khalil, Gautier, Lemoine 2007, eq. (10); found with a point mass's tensor"
    signature = "gravity and inertia on all joints, as if the last link had become heavier"
    rivals = ("encoder_offset", "gravity_tilt")
    experiment = "the same motion with and without the load"
    motion = ExperimentMotion.LOAD_CHANGES
    acts_on_link = True
    needs_reference_model = True
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    linear_in_coefficients = False
    taken_for_granted = (
        "The mass is as right as the measured torques: torque constants that are 10 % off make it"
        " 10 % off, beyond its standard deviation."
    )
    linear = (
        Coefficient("mass", "kg", lower=0.0, defining=True),
        *(Coefficient(f"first_moment_{axis}", "kg m") for axis in "xyz"),
    )
    Parameters = _Centre
    nonlinear = tuple(
        NonlinearParameter(
            f"about_{axis}",
            "m",
            (0.0,),
            -_FARTHEST_M,
            _FARTHEST_M,
            linear_grid=True,
            is_parameter=False,
        )
        for axis in "xyz"
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Centre]]:
        """One: all joints feel it."""
        return [self.at((arm.dof - 1,), _Centre(), rows=range(arm.dof))]

    def linearised_at(self, candidate: Candidate[_Centre], values: Array) -> Candidate[_Centre]:
        """With the tensor's slopes at the centre that a mass and first moment have."""
        mass, first = values[0], values[1:]
        if not mass > 0.0:
            return candidate
        centre = np.clip(first / mass, -_FARTHEST_M, _FARTHEST_M)
        return replace(candidate, parameters=_Centre(*centre.tolist()))

    def coefficients(self, parameters: _Centre, variant: str) -> tuple[Coefficient, ...]:
        """Mass and first moment, and the tensor in the last link's frame where it is its own."""
        return (*self.linear, *_TENSOR) if variant == _BODY else self.linear

    def final_form(self, candidate: Candidate[_Centre]) -> Candidate[_Centre]:
        """A body with a tensor of its own."""
        return self.at(candidate.joints, _Centre(), _BODY, candidate.rows)

    def columns(self, seen: Observed, candidate: Candidate[_Centre]) -> Array:
        """The last link's mass and first moment, with the change of its tensor with each."""
        rows = regressor(seen.arm.chain, seen.q, seen.qd, seen.qdd)[:, :, -10:]
        if candidate.variant == _BODY:
            return rows[:, :, _PLACES]
        centre = np.array(candidate.parameters)
        return rows[:, :, _PLACES[:4]] + rows[:, :, :6] @ _tensor_slopes(centre)

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Centre], values: Array
    ) -> SimulatedArm:
        """A heavier last link; of a tensor that no body has, the nearest one that a body has."""
        delta = arm.delta.copy()
        mass, first = values[0], np.asarray(values[1:4])
        centre = first / mass if mass > 0.0 else np.zeros(3)
        tensor = mass * _tensor(centre)
        if candidate.variant == _BODY:
            tensor = tensor + _of_a_body(np.asarray(values[4:]) - tensor)
        delta[-10:] += np.concatenate([tensor, first, [mass]])
        return replace(arm, delta=delta)


def _tensor(centre: Array) -> Array:
    """xx, xy, xz, yy, yz, zz of a point of 1 kg [m^2], shape (6,)."""
    return (centre @ centre * np.eye(3) - np.outer(centre, centre))[np.triu_indices(3)]


def _of_a_body(tensor: Array) -> Array:
    """The nearest tensor about a body's centre: no mass lies at a negative distance, shape (6,)."""
    whole = np.zeros((3, 3))
    whole[np.triu_indices(3)] = tensor
    whole = whole + np.triu(whole, 1).T
    lengths, axes = np.linalg.eigh(0.5 * np.trace(whole) * np.eye(3) - whole)
    spread = axes * np.maximum(lengths, 0.0) @ axes.T
    return (np.trace(spread) * np.eye(3) - spread)[np.triu_indices(3)]


def _tensor_slopes(centre: Array) -> Array:
    """Slopes of (p.p 1 - p p^T) / m in m and p, where p = m centre, shape (6, 4).

    The tensor is homogeneous of degree one: these slopes times (m, p) are the tensor itself.
    """
    axes = np.eye(3)
    along = [
        2.0 * c * axes - np.outer(e, centre) - np.outer(centre, e)
        for c, e in zip(centre, axes, strict=True)
    ]
    slopes = [-_tensor(centre), *(t[np.triu_indices(3)] for t in along)]
    return np.stack(slopes, axis=-1)


EFFECT = Payload()
