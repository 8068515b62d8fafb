"""An effect outside the catalogue: the curve of its torque as it was measured."""

from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

KNOTS = 9
VARIANTS = (
    "position",
    "position direction",
    "position velocity",
    "speed direction",
    "speed",
    "time",
    "time direction",
)
"""The variable of a curve, and what it multiplies."""


@term
def _hat(t, q, qd, load, joint, settings, resistance, level):
    x = q[joint]
    if settings[4] == 1.0:
        x = abs(qd[joint])
    elif settings[4] == 2.0:
        x = t
    x = min(max(x, settings[2]), settings[3])
    size = settings[0] * max(0.0, 1.0 - abs(x - settings[1]) / settings[6])
    if settings[5] == 1.0:
        level[joint] += size
    elif settings[5] == 2.0:
        resistance[joint] += size * qd[joint]
    else:
        resistance[joint] += size


_VARIABLES = {"position": 0.0, "speed": 1.0, "time": 2.0}
_FACTORS = {"direction": 1.0, "velocity": 2.0}


class _Curve(NamedTuple):
    """Values of the variable between which the curve is known."""

    low: float
    high: float


class MeasuredEffect(Effect[_Curve]):
    """tau = .. + f(x) u, f piecewise linear: x position, speed or time; u 1, direction or velocity.

    The variant names x and u, such as `position` or `speed direction`. Where one of the joint's own
    friction terms is such a curve already, the values that it would double are left at zero.
    """

    id = "measured_effect"
    title = "an effect without a name, as a measured curve"
    equation = (
        "tau_j += f(x), f(x) sgn(qd_j) or f(x) qd_j; x: q_j, |qd_j| or t; f piecewise linear, at_k"
        " its value at the k-th corner"
    )
    source = "linear splines: de Boor, A Practical Guide to Splines (2001), chapter III"
    signature = "depends on one variable of the joint as no effect of the catalogue does"
    experiment = "go through the whole range of the variable, slowly, in both directions"
    depends_on = ("direction",)
    Parameters = _Curve

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Curve]]:
        """None: it is measured where a gap has no name, and never looked for."""
        return []

    def coefficients(self, parameters: _Curve, variant: str) -> tuple[Coefficient, ...]:
        """The curve's value at each knot that is free."""
        unit = "N m s/rad" if _factor(variant) == "velocity" else "N m"
        return tuple(Coefficient(f"at_{k + 1}", unit) for k in _free(variant))

    def columns(self, seen: Observed, candidate: Candidate[_Curve]) -> Array:
        """Hats over the variable, times what they multiply."""
        j, variant = candidate.joints[0], candidate.variant
        x = {"position": seen.q[:, j], "speed": np.abs(seen.speed[:, j]), "time": seen.t}
        one = np.ones(len(seen.q))
        factor = {"direction": seen.direction[:, j], "velocity": seen.qd[:, j]}
        low, high = candidate.parameters
        place = np.clip((x[_variable(variant)] - low) / (high - low), 0.0, 1.0) * (KNOTS - 1)
        hats = np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.array(_free(variant))))
        return (hats * factor.get(_factor(variant), one)[:, None])[:, None, :]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Curve], values: Array
    ) -> SimulatedArm:
        """One term for each hat."""
        variant, j, (low, high) = candidate.variant, candidate.joints[0], candidate.parameters
        step = (high - low) / (KNOTS - 1)
        kinds = _VARIABLES[_variable(variant)], _FACTORS.get(_factor(variant), 0.0)
        items = []
        for k, value in zip(_free(variant), values, strict=True):
            centre = low + k * step
            settings = (float(value), centre, low, high, *kinds, step)
            items.append(Term(_hat, j, settings, _text(variant, j, settings)))
        return arm.with_terms(*items)


def curve_over(variant: str, joint: int, ends: dict[str, tuple[float, float]]) -> Candidate[_Curve]:
    """A curve on a joint (from 0), between the ends of its variable."""
    return EFFECT.at((joint,), _Curve(*ends[_variable(variant)]), variant)


def _variable(variant: str) -> str:
    return variant.split()[0]


def _factor(variant: str) -> str:
    return " ".join(variant.split()[1:])


def _free(variant: str) -> tuple[int, ...]:
    """The knots whose value no friction term doubles."""
    if not _factor(variant):
        return tuple(range(KNOTS))
    speed = _variable(variant) == "speed"
    return tuple(range(1, KNOTS - 1 if speed else KNOTS))


def _text(variant: str, j: int, settings: tuple[float, ...]) -> tuple[tuple[int, str], ...]:
    """A hat for exports; nothing over time, which they do not know."""
    if _variable(variant) == "time":
        return ()
    value, centre, low, high, _, _, step = settings
    x = f"q[{j}]" if _variable(variant) == "position" else f"fabs(qd[{j}])"
    kept = f"(0.5 * ({low!r} + {high!r} + fabs({x} - {low!r}) - fabs({x} - {high!r})))"
    hat = f"(1.0 - fabs({kept} - {centre!r}) / {step!r})"
    factor = {"direction": f" * sgn(qd[{j}])", "velocity": f" * qd[{j}]"}.get(_factor(variant), "")
    return ((j, f"{value!r} * 0.5 * ({hat} + fabs({hat})){factor}"),)


EFFECT = MeasuredEffect()
