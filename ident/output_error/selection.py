"""Which parts of servo and gears the recordings ask for: one after the other, joint by joint.

A part is tried at a few sizes with all else held, then fitted with all else; it stays at the joints
where held-out pieces are simulated better with it. An early part may have been taken in the place
of a later one, so that at the end each has to show once more that the others cannot do without it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Prior, Setup, fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.regression.progress import Tell
from ident.signals.arrays import Array

TURNING = ("turning_speed", "presliding", "rise_speed")
"""How dry friction turns round: nobody knows, so that it is fitted at every joint."""

BASE = ("stiffness", "armature", "damping", "coulomb", *TURNING, "delay")
"""What every joint has."""

_ROUNDS = 6
_SHARES = (1.0, 0.5, 0.1)  # of what a part stands in for
_LEAST_GAIN = 0.02  # nats per sample, of a joint's held-out error: 2 % smaller


@dataclass(frozen=True)
class Part:
    """Something that a servo or its gears may have.

    Attributes:
        name: in arms' files and reports.
        quantities: what it adds, the deciding one first.
        sizes: of the deciding one, to begin with; empty: where it is.
        relative: quantity that the sizes are parts of.
        of_servo: whether joints with the same servo have it alike.
        instead: quantity that grows where the part is left out, because it lags alike.
        rival: part that explains the same at first sight, and is tried at the same joints.
    """

    name: str
    quantities: tuple[str, ...]
    sizes: tuple[float, ...] = ()
    relative: str = ""
    of_servo: bool = False
    instead: str = ""
    rival: str = ""


PARTS = (
    Part("zero", ("zero",)),
    Part(
        "profile",
        ("profile_acceleration",),
        (3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0),
        "",
        True,
        "armature",
        "torque_limit",
    ),
    Part("torque_limit", ("torque_limit",), (0.03, 0.06, 0.09, 0.12, 0.17, 0.25), "stiffness"),
    Part("rate_gain", ("rate_gain",), (0.15, 0.4, 0.8), "damping", True),
    Part("load_friction", ("load_friction",), (0.05, 0.15, 0.4)),
    Part("stribeck", ("stribeck", "stribeck_speed"), (0.1, 0.3, 0.8), "coulomb"),
    Part("half_play", ("half_play",), (1e-3, 2e-3, 4e-3, 8e-3, 0.016), instead="coulomb"),
    Part("compliance", ("compliance",), (2e-3, 8e-3, 0.03)),
    Part("offset", ("offset",), (-0.3, 0.3), "coulomb"),
    Part("integral", ("integral",), (0.3, 1.0, 4.0), "stiffness", True),
    Part("dead_zone", ("dead_zone",), (2e-3, 5e-3), "", True),
    Part("profile_speed", ("profile_speed",), (0.5, 1.0, 2.0, 4.0), "", True),
)
"""In the order in which they are tried: what shapes the motion most comes first."""


@dataclass(frozen=True)
class Trial:
    """A part that was tried.

    Attributes:
        name: of the part.
        gain: logarithm of the held-out error's ratio, without over with it, shape (n,).
        kept: at which joints it stayed, shape (n,).
    """

    name: str
    gain: Array
    kept: NDArray[np.bool_]


@dataclass(frozen=True)
class Chosen:
    """What the search ends with.

    Attributes:
        fit: of the searched pieces.
        held_out: rms on the others [rad], shape (n,).
        trials: in their order.
    """

    fit: Fit
    held_out: Array
    trials: tuple[Trial, ...]


def rms(setup: Setup, settings: Array) -> Array:
    """Of simulated against measured positions, by joint [rad], shape (n,)."""
    return np.sqrt(np.mean(setup.residuals(settings) ** 2, axis=0))


def chosen(
    searched: Setup,
    other: Setup,
    start: Array,
    prior: Prior,
    may: NDArray[np.bool_],
    parts: Sequence[Part],
    same_servo: bool,
    tell: Tell,
) -> Chosen:
    """The parts that held-out pieces confirm, and the fit with them.

    Args:
        searched: pieces that are fitted.
        other: pieces that judge.
        start: settings of the base, shape (quantities, n).
        prior: what is believed.
        may: what may be fitted, shape (quantities, n): not what is known, nor joints at rest.
        parts: to be tried.
        same_servo: whether all joints have the same.
        tell: hears what is being done.
    """
    free = np.zeros(may.shape, dtype=bool)
    free[[ROW[name] for name in BASE]] = True
    tell("fitting servo and friction", 0.0)
    best = fit(searched, start, free & may, prior, _ROUNDS)
    judged, trials, named = rms(other, best.settings), [], {p.name: p for p in parts}

    def tried(part: Part) -> tuple[Fit, NDArray[np.bool_], Array]:
        """The fit with a part, what is new in it, and its gain at each joint."""
        new = np.zeros_like(free)
        new[[ROW[name] for name in part.quantities]] = True
        new &= may
        alike = part.of_servo and same_servo
        began = scanned(searched, best, part, np.any(new, axis=0), prior, alike=alike)
        loose = best.free | new
        loose[ROW["zero"]] &= new[ROW["zero"]]  # held while others are tried: they take long
        found = fit(searched, began, loose, prior, _ROUNDS)
        return found, new, np.log(judged / rms(other, found.settings))

    for k, part in enumerate(parts):
        tell(f"trying {part.name.replace('_', ' ')}", (k + 1) / (len(parts) + 1))
        if not may[[ROW[name] for name in part.quantities]].any():
            continue
        alike = part.of_servo and same_servo
        with_it, new, gain = tried(part)
        least = np.full_like(gain, _LEAST_GAIN)
        if part.rival in named:
            least = np.maximum(tried(named[part.rival])[2], least)
        kept = (gain > least) & new.any(axis=0)
        if part.name == "zero" or alike:  # one joint's zero turns the gravity of others
            kept = new.any(axis=0) & (gain.mean() > least.mean())
        trials.append(Trial(part.name, gain, kept))
        if not kept.any():
            continue
        if not kept[new.any(axis=0)].all():
            settings = np.where(new & ~kept, best.settings, with_it.settings)
            settings = np.where(kept, settings, best.settings)
            with_it = fit(searched, settings, with_it.free & ~(new & ~kept), prior, 2)
        after = rms(other, with_it.settings)
        if np.log(judged / after).sum() > _LEAST_GAIN:
            best, judged = replace(with_it, free=best.free | (new & kept)), after
        else:
            trials[-1] = Trial(part.name, gain, np.zeros_like(kept))
    best, trials = pruned(searched, other, best, prior, parts, trials, same_servo)
    return Chosen(best, rms(other, best.settings), tuple(trials))


def pruned(
    searched: Setup, other: Setup, best: Fit, prior: Prior, parts: Sequence[Part],
    trials: Sequence[Trial], same_servo: bool,
) -> tuple[Fit, list[Trial]]:  # fmt: skip
    """The arm without parts that it fits as well without, and the trials with what is left.

    All but zeros, which are the pose and no stand-in; a joint that loses a part begins again at
    the first guess of its other settings. The last part that was kept has just been judged so.
    """
    named, judged = {p.name: p for p in parts}, rms(other, best.settings)
    kept = [k for k, t in enumerate(trials) if t.kept.any()]
    trials = list(trials)
    for k in kept[:-1]:
        part, places = named[trials[k].name], trials[k].kept
        if part.name == "zero":
            continue
        rows, base = [ROW[q] for q in part.quantities], [ROW[q] for q in BASE]
        free, began = best.free.copy(), best.settings.copy()
        free[rows] &= ~places
        began[rows] = np.where(places, prior.center[rows], began[rows])
        began[base] = np.where(places & free[base], prior.center[base], began[base])
        without = fit(searched, began, free, prior, 2 * _ROUNDS)
        gain = np.log(rms(other, without.settings) / judged)
        alike = part.of_servo and same_servo
        drop = places & ((gain.mean() if alike else gain) <= _LEAST_GAIN)
        if not drop.any():
            continue
        free = best.free.copy()
        free[rows] &= ~drop
        settings = np.where(drop, without.settings, best.settings)
        lighter = fit(searched, settings, free, prior, 2)
        after = rms(other, lighter.settings)
        if np.log(after / judged).sum() < _LEAST_GAIN:
            best, judged = lighter, after
            trials[k] = Trial(part.name, trials[k].gain, places & ~drop)
    return best, trials


def scanned(
    setup: Setup, best: Fit, part: Part, places: NDArray[np.bool_], prior: Prior,
    *, alike: bool = False,
) -> Array:  # fmt: skip
    """Each joint where it fits best with a part at one of its sizes, shape (quantities, n).

    All else is as in the arm so far, or as in the first guess: settings that were fitted without
    the part may have gone far to make up for it. What it stands in for is also tried smaller.

    Args:
        setup: pieces that are fitted.
        best: the arm so far.
        part: what is tried.
        places: joints that get it, shape (n,).
        prior: what is believed; its centre is the first guess.
        alike: whether all joints have one size.
    """
    row, q = ROW[part.quantities[0]], QUANTITIES[ROW[part.quantities[0]]]
    basic = [ROW[name] for name in BASE]
    fresh = best.settings.copy()
    fresh[basic] = np.where(best.free[basic], prior.center[basic], fresh[basic])
    began, left = best.settings.copy(), np.full(len(places), np.inf)
    shares = _SHARES if part.instead else (1.0,)
    for origin, size, share in product((best.settings, fresh), part.sizes, shares):
        unit = origin[ROW[part.relative]] if part.relative else 1.0
        tried = np.where(places, origin, best.settings)
        tried[row] = np.where(places, np.clip(size * unit, q.low, q.high), tried[row])
        if part.instead:
            tried[ROW[part.instead]] *= np.where(places, share, 1.0)
        error = np.log(rms(setup, tried))
        error = np.full_like(error, error.mean()) if alike else error
        better = places & (error < left)
        began, left = np.where(better, tried, began), np.where(better, error, left)
    return began
