"""Settings with which the simulated arm answers the commands as the recorded one did.

Gauss-Newton with Levenberg's damping on the simulated positions, in closed loop: the servo keeps
the simulation on its way, so that long recordings need no restarts; a hole begins a new segment.
Derivatives take a joint's settings to move that joint alone; the residuals themselves are always
those of the coupled arm. Each joint has a damping of its own and keeps the step that helps it, so
that one that sticks does not hold up the others.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.output_error.coordinates import bounds, coordinates, settings_at
from ident.output_error.setup import MEMORY_S, Prior, Setup
from ident.output_error.slopes import NEAR, columns
from ident.signals.arrays import Array

Progress = Callable[[int, float], None]

_DAMPED = 1e-2  # share of the Hessian's diagonal that is added at first
_TRIES = 7
_LONGEST = 1.0  # step in a coordinate
_ENOUGH = 3e-3  # nats by which a step must help, per effective sample


@dataclass(frozen=True)
class Fit:
    """A fit's end.

    Attributes:
        settings: shape (quantities, n).
        free: which of them were fitted, shape (quantities, n).
        residuals: [rad], shape (S, n).
        cost: twice the negative logarithm of the posterior, but for a constant.
        rounds: steps that were taken.
    """

    settings: Array
    free: NDArray[np.bool_]
    residuals: Array
    cost: float
    rounds: int

    @property
    def rms(self) -> Array:
        """Of the residuals by joint [rad], shape (n,)."""
        return np.sqrt(np.mean(self.residuals**2, axis=0))


def fit(
    setup: Setup,
    start: Array,
    free: NDArray[np.bool_],
    prior: Prior,
    rounds: int = 15,
    progress: Progress | None = None,
) -> Fit:
    """The most probable settings near a start.

    Args:
        setup: arm and recordings.
        start: settings, shape (quantities, n).
        free: which of them to fit, shape (quantities, n).
        prior: what is believed of them.
        rounds: times that derivatives are taken, about.
        progress: is told round and rms [rad].
    """
    pairs = np.argwhere(free)
    at = tuple(pairs.T)
    settings, damping, taken = np.clip(start, *bounds()), np.full(start.shape[1], _DAMPED), 0
    reach = 1.0
    residuals = setup.residuals(settings)
    informed = setup.seconds / MEMORY_S
    cost = _cost(setup, settings, free, prior, residuals, informed)
    made, kept = np.empty(0), False  # columns serve two steps where the first helps
    for _ in range(2 * rounds):
        made = made if kept else columns(setup, settings, free, reach)
        weight = informed / len(residuals) / np.mean(residuals**2, axis=0)
        hessian, slope = prior.pull(settings, free)
        hessian += np.einsum("asj,bsj,j->ab", made, made, weight, optimize=True)
        slope += np.einsum("asj,sj,j->a", made, residuals, weight, optimize=True)
        place, before = coordinates(settings), cost
        loose = np.flatnonzero(~_stopped(settings, free, slope))
        looking = np.ones(start.shape[1], dtype=bool)  # joints that have no better place yet
        for _ in range(_TRIES):
            lifted = hessian + np.diag(damping[at[1]] * np.diag(hessian))
            step = np.zeros(len(pairs))
            step[loose] = np.linalg.solve(lifted[np.ix_(loose, loose)], slope[loose])
            promised = np.bincount(at[1], slope * step, len(looking))
            looking &= promised > _ENOUGH * informed / len(looking)
            if not looking.any():
                break
            moved = place.copy()
            moved[at] += np.clip(step, -_LONGEST, _LONGEST)
            trial = np.where(looking & free, settings_at(moved), settings)
            left = setup.residuals(trial)
            better = looking & (np.mean(left**2, axis=0) < np.mean(residuals**2, axis=0))
            if better.any() and not better[looking].all():
                trial = np.where(better, trial, settings)
                left = setup.residuals(trial)
            new = _cost(setup, trial, free, prior, left, informed)
            if better.any() and new < cost:
                settings, residuals, cost = trial, left, new
                damping[better] = np.maximum(damping[better] / 5, 1e-6)
                looking &= ~better
                taken += 1
            damping[looking] *= 5
        if progress is not None:
            progress(taken, float(np.sqrt(np.mean(residuals**2))))
        helped = before - cost > _ENOUGH * informed
        if not (helped or kept):
            if reach == NEAR:
                break
            reach = NEAR
        damping = damping if helped else np.full_like(damping, _DAMPED)
        kept = helped and not kept
    return Fit(settings, free, residuals, cost, taken)


def _stopped(settings: Array, free: NDArray[np.bool_], slope: Array) -> NDArray[np.bool_]:
    """Which free settings lie on a bound beyond which the slope would take them."""
    low, high = bounds()
    at_low, at_high = (settings <= low)[free], (settings >= high)[free]
    return (at_low & (slope < 0.0)) | (at_high & (slope > 0.0))


def _cost(
    setup: Setup,
    settings: Array,
    free: NDArray[np.bool_],
    prior: Prior,
    residuals: Array,
    informed: float,
) -> float:
    fitting = informed * np.sum(np.log(np.mean(residuals**2, axis=0)))
    hessian, slope = prior.pull(settings, free)
    off = np.linalg.solve(hessian, slope)
    return float(fitting + off @ slope)
