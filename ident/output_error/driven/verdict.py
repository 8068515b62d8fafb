"""What a search along recorded torque may say: which effects are sure, and what is left."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.driven.columns import DrivenArm
from ident.output_error.driven.fit import DrivenFit, covariance, fitted, floor_of
from ident.output_error.driven.search import (
    TRIAL_ROUNDS,
    DrivenSearch,
    Step,
    block_errors,
    block_groups,
    gain_of_all,
)
from ident.output_error.driven.starts import LEAST_GAIN, Start, gives, shown
from ident.output_error.judging import explained, rms, sureness_of_all
from ident.output_error.missing.nulls import white_noise
from ident.output_error.parameters import ROW
from ident.output_error.search.selection import clearly_off
from ident.output_error.search.settings import SearchSettings
from ident.regression.progress import Tell
from ident.signals.arrays import Array

_THIRDS = 3
_STIFF = 0.03  # of the size that was found


@dataclass(frozen=True)
class Named:
    """An effect with its evidence.

    Attributes:
        step: the effect and its rivals.
        sd: standard deviation of each of its quantities, in the order of the part.
        deviations: standard deviations of its size from nothing.
        gains: by which each third of the recordings is predicted better [nats per sample].
        doubt: why it is not sure; empty: it is.
    """

    step: Step
    sd: tuple[float, ...]
    deviations: float
    gains: tuple[float, ...]
    doubt: str


@dataclass(frozen=True)
class DrivenOutcome:
    """A search with its verdict.

    Attributes:
        kind: of the verdict, in one word.
        base, end: fits without and with the named effects.
        before, after: errors of blocks that are left out, without and with them [rad^2], (B, n).
        floor: rms that steps and white noise of the positions leave [rad], shape (n,).
        effects: named ones.
        suspected: the others.
        unexplained: joints, from 0, at which more is left than that.
        smallest: size of each effect that would be seen, by joint; NaN: none, shape (n,).
    """

    kind: str
    base: DrivenFit
    end: DrivenFit
    before: Array
    after: Array
    floor: Array
    effects: tuple[Named, ...]
    suspected: tuple[Named, ...]
    unexplained: tuple[int, ...]
    smallest: dict[str, Array]


def verdict(
    arm: DrivenArm, found: DrivenSearch, moving: NDArray[np.bool_], limits: SearchSettings,
    tell: Tell,
) -> DrivenOutcome:  # fmt: skip
    """What the search may say.

    Args:
        arm: arm and recordings.
        found: the search.
        moving: joints that moved, shape (n,).
        limits: numbers that decide.
        tell: hears what is being done.
    """
    tell("how well it is known")
    end, usual = found.end, floor_of(arm.setup)
    floor = np.hypot(usual, white_noise(replace(arm.setup, delta=end.links), end.settings))
    named = _named(arm, found, floor, limits)
    suspected = tuple(n for n in named if n.doubt)
    if suspected:
        sure = tuple(n.step for n in named if not n.doubt)
        found = replace(found, steps=_without(arm, found, sure))
        named, end = _named(arm, found, floor, limits), found.end
    effects = tuple(n for n in named if not n.doubt)
    off = moving & clearly_off(found.left, floor, arm.setup.resolution, limits)
    gap = np.maximum(rms(found.errors) ** 2 - floor**2, 1e-30)
    off &= (rms(found.left) ** 2 - floor**2) / gap > limits.unclosed
    kind = "named" if effects else "no_gap"
    kind = "ambiguous" if any(n.step.rivals for n in effects) else kind
    left = tuple(np.flatnonzero(off).tolist())
    clear = np.sqrt(limits.clear**2 - 1.0) * floor
    smallest = shown(
        arm, end, moving, floor, np.maximum(clear, limits.clear_steps * arm.setup.resolution)
    )
    for n in effects:
        smallest[n.step.tried.start.kind.name][n.step.tried.start.joint] = np.nan
    return DrivenOutcome(
        "unknown" if left else kind,
        found.base, end, found.errors, found.left, floor, effects, suspected, left, smallest,
    )  # fmt: skip


def closes_a_gap(
    before: Array, after: Array, floor: Array, resolution: Array, limits: SearchSettings
) -> bool:
    """Whether errors were clearly beyond noise at a joint, and became smaller there by as much.

    Friction that turns round as no model of it does leaves less than that, and a spring beside it
    may do what the right curve would.

    Args:
        before: errors of blocks that are left out [rad^2], shape (B, n).
        after: likewise, with an effect.
        floor: rms that steps and white noise of the positions leave [rad], shape (n,).
        resolution: smallest step of the positions [rad], shape (n,).
        limits: numbers that decide.
    """
    off = clearly_off(before, floor, resolution, limits)
    return bool((off & (explained(before, after) > limits.clear_steps * resolution)).any())


def beats_stiff_gears(
    arm: DrivenArm, found: DrivenSearch, start: Start, limits: SearchSettings
) -> bool:
    """Whether gears that give predict better than stiff ones with the friction that came with them.

    Friction before and behind the gears, and the damper in them, turn round in a way of their own,
    which the joint's friction may ask for whether its gears give or not.

    Args:
        arm: arm and recordings.
        found: the search.
        start: the gears' start, one of the search's steps.
        limits: numbers that decide.
    """
    end = found.end
    settings = end.settings.copy()
    settings[start.size_at] *= _STIFF
    further = [m for m in end.further if m.place != start.size_at]
    stiff = fitted(arm, end.beta, settings, further, rounds=TRIAL_ROUNDS)
    errors = block_errors(arm, stiff, block_groups(arm))
    better = gain_of_all(errors, found.left), sureness_of_all(errors, found.left)
    return better[0] > LEAST_GAIN and better[1] > limits.sure


def _named(
    arm: DrivenArm, found: DrivenSearch, floor: Array, limits: SearchSettings
) -> tuple[Named, ...]:
    """Every effect with its evidence, beside all others."""
    end, made, before = found.end, [], found.errors
    sd = np.sqrt(np.diag(covariance(arm, end)))[len(end.beta) :]
    for step in found.steps:
        start, errors = step.tried.start, step.tried.errors
        spread, away = {}, np.inf
        for m, x in zip(end.further, sd, strict=True):
            if m in start.further:
                value = end.settings[m.place]
                spread[m.place] = x * (m.unit or value)
                if m.place == start.size_at:
                    away = abs(value) / spread[m.place] if m.unit else 1.0 / x
        thirds = zip(np.array_split(before, _THIRDS), np.array_split(errors, _THIRDS), strict=True)
        gains = tuple(gain_of_all(a, b) for a, b in thirds)
        doubt = ""
        if away < limits.sure_size:
            doubt = f"its size is only {away:.1f} standard deviations from nothing"
        elif min(gains) <= 0.0:
            doubt = "some of the motions are predicted better without it"
        elif not closes_a_gap(before, errors, floor, arm.setup.resolution, limits):
            doubt = "without it hardly more is left than noise and the encoders' steps leave"
        elif gives(start.kind) and not beats_stiff_gears(arm, found, start, limits):
            doubt = "friction at both ends of gears that do not give explains as much"
        own = [(ROW[name], start.joint) for name in start.kind.part.quantities]
        told = tuple(float(spread.get(place, np.nan)) for place in own)
        made.append(Named(step, told, float(away), gains, doubt))
        before = errors
    return tuple(made)


def _without(arm: DrivenArm, found: DrivenSearch, sure: tuple[Step, ...]) -> tuple[Step, ...]:
    """The sure steps, fitted anew one after the other."""
    fit, made, group, before = found.base, [], block_groups(arm), found.errors
    for step in sure:
        start = step.tried.start
        settings = fit.settings.copy()
        for m in start.further:
            settings[m.place] = found.end.settings[m.place]
        fit = fitted(arm, fit.beta, settings, (*fit.further, *start.further))
        errors = block_errors(arm, fit, group)
        tried = replace(step.tried, fit=fit, errors=errors, gain=gain_of_all(before, errors))
        made.append(replace(step, tried=tried))
        before = errors
    return tuple(made)
