"""A base that is not level."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.dynamics.compiled_chain import Chain, weights
from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion, FormUncertainty
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

_NOTHING = 1e-6
_MOST = 0.35  # rad
_FIRST_LINK = tuple(Coefficient(f"first_link_{s}", "N m") for s in ("cosine", "sine"))


@term
def _first_link(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0] * np.cos(q[joint]) + settings[1] * np.sin(q[joint])


class _Tilt(NamedTuple):
    """The two base axes of the tilt; whether the first link joins (1); None: it is known."""

    axes: str
    first_link: float | None = None


class GravityTilt(Effect[_Tilt]):
    """Gravity turned about the base's x and y axes."""

    id = "gravity_tilt"
    title = "a base that is not level"
    equation = (
        "g = R_x(tilt_x) R_y(tilt_y) g_0, to first order in the angles; tau_1 +="
        " first_link_cosine cos(q_1) + first_link_sine sin(q_1)"
    )
    source = "the gravity term of (1), differentiated by the direction of gravity"
    signature = (
        "gravity torque where a level base has none: at joint 1, as sin and cos of its angle"
    )
    rivals = ("encoder_offset", "torque_offset")
    intervention = "put the base on a wedge of a known angle and record the same motion again"
    experiment = "turn joint 1 through more than 180 degrees with the arm stretched out level"
    motion = ExperimentMotion.STRETCHED_SWEEP
    acts_on_link = True
    form_uncertainty = FormUncertainty.NONE
    band_limited = True
    depends_on = ("model",)
    Parameters = _Tilt
    nonlinear = (
        NonlinearParameter(
            "first_link",
            "1",
            (0.0, 1.0),
            0.0,
            1.0,
            discrete=True,
            refine_only=True,
            is_parameter=False,
        ),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Tilt]]:
        """One: all joints feel it.

        Where the first joint is upright, a level base never shows the first link's own moments;
        their torque on a tilted one is fitted once the effect leads.
        """
        return [self.at(range(arm.dof), _Tilt(_axes(arm), 0.0 if _upright(arm) else None))]

    def coefficients(self, parameters: _Tilt, variant: str) -> tuple[Coefficient, ...]:
        """Two angles, and the first link's torque as cosine and sine of its angle."""
        tilts = tuple(Coefficient(f"tilt_{s}", "rad", -_MOST, _MOST) for s in parameters.axes)
        return tilts if parameters.first_link is None else (*tilts, *_FIRST_LINK)

    def columns(self, seen: Observed, candidate: Candidate[_Tilt]) -> Array:
        """Change of the gravity torque per tilt angle; cosine and sine of the first joint.

        What the tilt does at joint 1 while all others are at zero counts as the first link's.
        """
        arm, first_link = seen.arm, candidate.parameters.first_link
        turned = _turned(arm)
        tilts = weights(arm.chain, arm.delta, np.ascontiguousarray(seen.q)) @ turned
        if first_link is None:
            return tilts
        waves = np.column_stack([np.cos(seen.q[:, 0]), np.sin(seen.q[:, 0])])
        tilts[:, 0] -= waves @ _at_zero(arm.chain, arm.delta) @ turned
        alone = np.zeros_like(tilts)
        alone[:, 0] = first_link * waves
        return np.concatenate([tilts, alone], axis=-1)

    def assumption_of(self, candidate: Candidate[_Tilt]) -> str:
        """Where the first joint is not upright, a turn about its axis is no tilt alone."""
        if candidate.parameters.first_link is not None:
            return ""
        return (
            "A base turned about joint 1's own axis is the same as an error of that joint's zero"
            " position: that part of the tilt may be either."
        )

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Tilt], values: Array
    ) -> SimulatedArm:
        """Gravity in another direction."""
        angle = np.zeros(3)
        for coefficient, value in zip(candidate.coefficients, values, strict=True):
            if coefficient.name.startswith("tilt"):
                angle["xyz".index(coefficient.name[-1])] = value
        gravity = arm.chain.gravity + np.cross(angle, arm.chain.gravity)
        gravity *= np.linalg.norm(arm.chain.gravity) / np.linalg.norm(gravity)
        arm = replace(arm, chain=arm.chain._replace(gravity=gravity))
        if candidate.parameters.first_link is not None:
            cosine, sine = values[-2:] - _at_zero(arm.chain, arm.delta) @ arm.chain.gravity
            parts = float(cosine), float(sine)
            text = f"{parts[0]!r} * cos(q[0]) + {parts[1]!r} * sin(q[0])"
            item = Term(_first_link, 0, parts, ((0, text),))
            arm = arm.with_terms(item)
        return arm


def _at_zero(chain: Chain, delta: Array) -> Array:
    """Weight at joint 1 with all others at zero: cosine and sine over its angle, shape (2, 3)."""
    q = np.zeros((2, len(delta) // 10))
    q[1, 0] = np.pi / 2
    return weights(chain, delta, q)[:, 0]


def _turned(arm: ArmFacts) -> Array:
    """Change of gravity per angle about the two base axes, shape (3, 2)."""
    axes = [np.eye(3)["xyz".index(axis)] for axis in _axes(arm)]
    return np.cross(axes, arm.chain.gravity).T


def _upright(arm: ArmFacts) -> bool:
    """Whether the first link's first moments are felt on a tilted base only."""
    q = np.zeros((1, arm.dof))
    moments = np.zeros(10 * arm.dof)
    moments[6:9] = 1.0
    felt = weights(arm.chain, moments, q)[0, 0]
    return abs(felt @ arm.chain.gravity) < _NOTHING * np.abs(felt @ _turned(arm)).max()


def _axes(arm: ArmFacts) -> str:
    """The two base axes that are not along gravity."""
    along = int(np.abs(arm.chain.gravity).argmax())
    return "".join(s for i, s in enumerate("xyz") if i != along)


EFFECT = GravityTilt()
