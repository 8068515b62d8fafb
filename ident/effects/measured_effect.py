"""An effect outside the catalogue: the curve of its torque as it was measured."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient
from ident.effects.effect import Array, Effect
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

KNOTS = 9
"""Corners of a curve, where its parameters do not say otherwise."""

VARIANTS = (
    "position",
    "position direction",
    "position velocity",
    "speed direction",
    "speed",
    "time",
    "time direction",
)
"""The variable of a curve over the joint's own motion, and what it multiplies."""

PERIODIC = "angle"
"""A curve over the joint's position that comes again with each period of it."""

ACROSS = ("other position", "other velocity", "other velocity velocity")
"""The same of a curve over another joint's motion."""


_VARIABLES = {
    "position": 0.0,
    "speed": 1.0,
    "time": 2.0,
    PERIODIC: 3.0,
    "other position": 0.0,
    "other velocity": 4.0,
}
_FACTORS = {"": 0.0, "direction": 1.0, "velocity": 2.0}


@term
def _hat(t, q, qd, load, joint, settings, resistance, level):
    value, centre, low, high, variable, factor, step, over = settings
    x = q[int(over)]
    if variable == 1.0:
        x = abs(qd[joint])
    elif variable == 2.0:
        x = t
    elif variable == 4.0:
        x = qd[int(over)]
    if variable == 3.0:
        away = abs(x - centre) % (high - low)
        away = min(away, high - low - away)
    else:
        away = abs(min(max(x, low), high) - centre)
    size = value * max(0.0, 1.0 - away / step)
    if factor == 1.0:
        level[joint] += size
    elif factor == 2.0:
        resistance[joint] += size * qd[joint]
    else:
        resistance[joint] += size


class _Curve(NamedTuple):
    """Values of the variable between which the curve is known, and how many corners it has.

    Of an angle, one period.
    """

    low: float
    high: float
    knots: int = KNOTS


class MeasuredEffect(Effect[_Curve]):
    """tau = .. + f(x) u, f piecewise linear: x position, speed, time, or another joint's motion.

    u is 1, the direction or the velocity of the joint itself. The variant names x and u, such as
    `position` or `speed direction`; `angle` is a position of which f is periodic. A second joint is
    the one whose motion x is. Where one of the joint's own friction terms is such a curve already,
    the values that it would double are left at zero.
    """

    id = "measured_effect"
    title = "an effect without a name, as a measured curve"
    equation = (
        "tau_j += f(x), f(x) sgn(qd_j) or f(x) qd_j; x: q_j, |qd_j|, t, or q_i or qd_i of another"
        " joint; f piecewise linear, at_k its value at the k-th corner"
    )
    source = "linear splines: de Boor, A Practical Guide to Splines (2001), chapter III"
    signature = "depends on one variable as no effect of the catalogue does"
    experiment = "go through the whole range of the variable, slowly, in both directions"
    depends_on = ("direction",)
    Parameters = _Curve

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Curve]]:
        """None: it is measured where a gap has no name, and never looked for."""
        return []

    def coefficients(self, parameters: _Curve, variant: str) -> tuple[Coefficient, ...]:
        """The curve's value at each knot that is free."""
        unit = "N m s/rad" if _factor(variant) == "velocity" else "N m"
        return tuple(Coefficient(f"at_{k + 1}", unit) for k in _free(variant, parameters.knots))

    def columns(self, seen: Observed, candidate: Candidate[_Curve]) -> Array:
        """Hats over the variable, times what they multiply."""
        j, i, variant = candidate.joints[0], candidate.joints[-1], candidate.variant
        low, high, knots = candidate.parameters
        free = np.array(_free(variant, knots))
        x = {
            "speed": np.abs(seen.speed[:, j]),
            "time": seen.t,
            "other velocity": seen.qd[:, i],
        }.get(_variable(variant), seen.q[:, i])
        place = (x - low) / (high - low) * (knots - 1)
        if _variable(variant) == PERIODIC:
            apart = (place[:, None] - free) % (knots - 1)
            apart = np.minimum(apart, knots - 1 - apart)
        else:
            apart = np.abs(np.clip(place, 0.0, knots - 1.0)[:, None] - free)
        hats = np.maximum(0.0, 1.0 - apart)
        factor = {"direction": seen.direction[:, j], "velocity": seen.qd[:, j]}
        one = np.ones(len(seen.q))
        return (hats * factor.get(_factor(variant), one)[:, None])[:, None, :]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Curve], values: Array
    ) -> SimulatedArm:
        """One term for each hat."""
        variant, (low, high, knots) = candidate.variant, candidate.parameters
        j, i = candidate.joints[0], candidate.joints[-1]
        step = (high - low) / (knots - 1)
        kinds = _VARIABLES[_variable(variant)], _FACTORS[_factor(variant)]
        items = []
        for k, value in zip(_free(variant, knots), values, strict=True):
            centre = low + k * step
            settings = (float(value), centre, low, high, *kinds, step, float(i))
            items.append(Term(_hat, j, settings, _text(variant, j, settings)))
        return arm.with_terms(*items)


def curve_over(
    variant: str, joints: tuple[int, ...], ends: tuple[float, float], knots: int = KNOTS
) -> Candidate[_Curve]:
    """A curve on a joint, between the ends of its variable.

    Args:
        variant: one of `VARIANTS` or `ACROSS`, or `PERIODIC`.
        joints: the joint, from 0; with `ACROSS`, and the one over whose motion the curve goes.
        ends: of the variable [rad, rad/s or s].
        knots: number of the curve's corners.
    """
    return EFFECT.at(joints, _Curve(*ends, knots), variant, joints[:1])


def curve_in_words(variant: str, joints: Sequence[int]) -> str:
    """What a curve goes over, and what it multiplies, in words; joints from 1."""
    own, other = joints[0], joints[-1]
    over = {
        "position": f"the position of joint {own}",
        "speed": f"the speed of joint {own}",
        "time": "the time since the start",
        PERIODIC: f"the position of joint {own}, again with each period",
        "other position": f"the position of joint {other}",
        "other velocity": f"the velocity of joint {other}",
    }[_variable(variant)]
    factor = {
        "direction": f", following the direction of joint {own}",
        "velocity": f", times the velocity of joint {own}",
    }
    return over + factor.get(_factor(variant), "")


def _variable(variant: str) -> str:
    return " ".join(variant.split()[:2]) if variant.startswith("other") else variant.split()[0]


def _factor(variant: str) -> str:
    return variant.removeprefix(_variable(variant)).strip()


def _free(variant: str, knots: int) -> tuple[int, ...]:
    """The corners whose value is free: no friction term doubles it, and of a period once each."""
    variable = _variable(variant)
    if variable == PERIODIC:
        return tuple(range(knots - 1))
    if not _factor(variant):
        return tuple(range(knots))
    return tuple(range(1, knots - 1 if variable == "speed" else knots))


def _text(variant: str, j: int, settings: tuple[float, ...]) -> tuple[tuple[int, str], ...]:
    """A hat for exports; nothing over time, which they do not know."""
    variable = _variable(variant)
    if variable == "time":
        return ()
    value, centre, low, high, _, _, step, over = settings
    x = {"speed": f"fabs(qd[{j}])", "other velocity": f"qd[{over:.0f}]"}.get(
        variable, f"q[{over:.0f}]"
    )
    if variable == PERIODIC:
        period = high - low
        turns = f"floor(({x} - {centre!r}) / {period!r} + 0.5)"
        away = f"fabs({x} - {centre!r} - {period!r} * {turns})"
    else:
        kept = f"(0.5 * ({low!r} + {high!r} + fabs({x} - {low!r}) - fabs({x} - {high!r})))"
        away = f"fabs({kept} - {centre!r})"
    hat = f"(1.0 - {away} / {step!r})"
    factor = {"direction": f" * sgn(qd[{j}])", "velocity": f" * qd[{j}]"}.get(_factor(variant), "")
    return ((j, f"{value!r} * 0.5 * ({hat} + fabs({hat})){factor}"),)


EFFECT = MeasuredEffect()
