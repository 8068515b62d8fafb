"""A part put into the simulated arm at many joints at once, fitted, and judged by joint."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ident.output_error.fit import Fit, fit
from ident.output_error.judging import gain, left_out
from ident.output_error.parameters import PER_STIFFNESS, QUANTITIES, ROW
from ident.output_error.search.parts import BASE, Part
from ident.output_error.search.screening import Places
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import Prior, Setup
from ident.regression.progress import Tell
from ident.signals.arrays import Array

_NOTHING = 1e-6  # of a quantity's scale


@dataclass(frozen=True)
class Trial:
    """A part that was tried.

    Attributes:
        part: what was tried.
        places: joints at which it was, shape (n,).
        fit: with it at all of them.
        errors: of blocks of time that are left out [rad^2], shape (B, n); of the places only.
        gain: nats per sample on them, by joint, shape (n,); 0 where it was not.
    """

    part: Part
    places: Places
    fit: Fit
    errors: Array
    gain: Array

    def is_nothing(self, joint: int) -> bool:
        """Whether the part's size came out at nothing: another of its quantities is what helps."""
        row = ROW[self.part.quantities[0]]
        q = QUANTITIES[row]
        return q.low == q.first == 0.0 and self.fit.settings[row, joint] <= _NOTHING * q.scale


def trials(
    setup: Setup, best: Fit, judged: Array, asked: dict[Part, Places], prior: Prior,
    settings: SearchSettings, tell: Tell, *, same_servo: bool = False,
) -> list[Trial]:  # fmt: skip
    """Trials of parts, each at all of its joints at once.

    One that other joints feel too is tried at one joint after the other, unless all have it.

    Args:
        setup: arm and recordings.
        best: the arm so far.
        judged: its errors on blocks that are left out, shape (B, n).
        asked: joints at which each part is tried.
        prior: what is believed.
        settings: numbers that decide.
        tell: hears what is being done.
        same_servo: whether all joints have the same.
    """
    made = []
    for k, (part, places) in enumerate(asked.items()):
        if places.any():
            tell(f"trying {part.name.replace('_', ' ')}", k / len(asked))
        apart = part.felt_elsewhere and not part.common
        for group in np.diag(places) if apart else [places]:
            if not group.any():
                continue
            alike = same_servo and part.common
            began = [
                start
                for origin in _forms(best, part, group)
                for start in scanned(setup, origin, part, group, prior, alike=alike)
            ]
            made.append(_tried(setup, best, judged, part, group, began, prior, settings.fit_rounds))
    return made


def _forms(best: Fit, part: Part, places: Places) -> list[Fit]:
    """The arm so far, with each form of a part whose forms are too unlike to be told afterwards."""
    if not part.unlike:
        return [best]
    made = []
    for form in part.forms:
        settings = best.settings.copy()
        settings[ROW[part.form], places] = form
        made.append(replace(best, settings=settings))
    return made


def _tried(
    setup: Setup, best: Fit, judged: Array, part: Part, places: Places, starts: Sequence[Array],
    prior: Prior, rounds: int,
) -> Trial:  # fmt: skip
    new = np.zeros_like(best.free)
    new[[ROW[name] for name in part.quantities]] = places
    loose = best.free | new
    if not part.felt_elsewhere:  # the other joints hardly feel it, and zeros take long
        loose &= places
        loose[ROW["zero"]] = False
    fits = [fit(setup, start, loose, prior, rounds) for start in starts]
    found = _joint_by_joint(setup, fits, prior)
    errors = felt(part, places, judged, left_out(setup, found, prior))
    found = replace(found, free=best.free | new)
    return Trial(part, places, found, errors, np.where(places, gain(judged, errors), 0.0))


def _joint_by_joint(setup: Setup, fits: Sequence[Fit], prior: Prior) -> Fit:
    """Each joint as in that of some fits which leaves it the least."""
    least = np.argmin([f.rms for f in fits], axis=0)
    among = least[fits[0].free.any(axis=0)]
    if (among == among[0]).all():
        return fits[among[0]]
    mixed = np.choose(least, [f.settings for f in fits])
    return fit(setup, mixed, fits[0].free, prior, 1)


def felt(part: Part, places: Places, before: Array, after: Array) -> Array:
    """Errors with a part; what other joints gain by it counts at its own.

    Args:
        part: what was added.
        places: where, shape (n,).
        before: errors without it, shape (B, n).
        after: errors with it, shape (B, n).
    """
    if not part.felt_elsewhere or part.common:
        return after
    all_joints = np.prod(after / before, axis=1)[:, None]
    return np.where(places, before * all_joints, after)


def scanned(
    setup: Setup, best: Fit, part: Part, places: Places, prior: Prior,
    *, alike: bool = False,
) -> list[Array]:  # fmt: skip
    """Where fits with a part begin, shape (quantities, n) each.

    All else is as in the arm so far, or as in the first guess: settings that were fitted without
    the part may have gone far to make up for it. What it stands in for is also tried smaller, or
    larger. The first start is each joint at the size that fits best; from there a fit may stay
    where the arm was without the part, so that the second has the next larger size. A part of the
    servo, and what other joints feel too, moves the arm far enough from one start.

    Args:
        setup: arm and recordings.
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
    sizes = part.sizes or (1.0,)
    began = [best.settings.copy() for _ in sizes]
    left = np.full((len(sizes), len(places)), np.inf)
    tried, of_size = [], []
    for origin, (k, size), share in product(
        (best.settings, fresh), enumerate(part.sizes), part.shares if part.instead else (1.0,)
    ):
        unit = origin[ROW[part.relative]] if part.relative else 1.0
        trial = np.where(places, origin, best.settings)
        trial[row] = np.where(places, np.clip(size * unit, q.low, q.high), trial[row])
        if part.instead:
            trial[_with(part.instead)] *= np.where(places, share, 1.0)
        tried.append(trial)
        of_size.append(k)
    for k, trial, residuals in zip(of_size, tried, setup.residuals_of(tried), strict=True):
        error = 0.5 * np.log(np.mean(residuals**2, axis=0))
        error = np.full_like(error, error.mean()) if alike else error
        better = places & (error < left[k])
        began[k] = np.where(better, trial, began[k])
        left[k] = np.where(better, error, left[k])
    first = np.argmin(left, axis=0)
    starts = [np.choose(first, began)]
    if part.sizes and not (part.servo or part.felt_elsewhere):
        larger = np.array([_next_larger(sizes, k) for k in range(len(sizes))])[first]
        starts.append(np.choose(larger, began))
    return starts


def _with(name: str) -> list[int]:
    """Rows of a quantity and of those that are parts of it."""
    return [ROW[k] for k in (name, *(PER_STIFFNESS if name == "stiffness" else ()))]


def _next_larger(sizes: Sequence[float], k: int) -> int:
    """The next larger one of the same sign; of the largest, the next smaller one."""
    alike = [i for i in range(len(sizes)) if sizes[i] * sizes[k] > 0]
    beyond = [i for i in alike if abs(sizes[i]) > abs(sizes[k])]
    others = beyond or [i for i in alike if i != k] or [k]
    return min(others, key=lambda i: abs(abs(sizes[i]) - abs(sizes[k])))
