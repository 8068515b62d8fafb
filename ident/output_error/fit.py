"""Settings with which the simulated arm answers the commands as the recorded one did.

Gauss-Newton with Levenberg's damping on the simulated positions, in closed loop: the servo keeps
the simulation on its way, so that long recordings need no restarts; a hole begins a new segment.
Derivatives are differences of whole simulations. A setting of one joint is taken to move that
joint alone (a geared arm's joints hardly feel each other), so that one simulation serves all
joints; zero positions, which turn the gravity of others, have a simulation each. The residuals
themselves are always those of the coupled arm. Each joint has a damping of its own and keeps the
step that helps it, so that one that sticks does not hold up the others.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain
from ident.output_error.parameters import PER_STIFFNESS, QUANTITIES, ROW
from ident.output_error.plant import Motion, simulate
from ident.signals.arrays import Array

Progress = Callable[[int, float], None]

SLOPE_STEP_S = 0.002
"""Of searches, and of simulations that are compared with each other; the error of a coarser one
passes for play and planned speed."""

NEAR = 0.3
"""Part of a fit's first reach: where that helps no more, and for what is known at the end."""

MEMORY_S = 0.4
"""Residuals closer than this say the same."""

_STIFFNESS = ROW["stiffness"]
_AWAY = 1e6  # rad: where a simulation that ran away is taken to be
_REACHING = ("zero",)  # felt by other joints
_NUDGE = 0.1  # of a logarithm; sticking makes smaller changes uneven
_PART = 0.3  # the same of a quantity's scale
_DAMPED = 1e-2  # share of the Hessian's diagonal that is added at first
_TRIES = 7
_LONGEST = 1.0  # step in a coordinate
_ENOUGH = 3e-3  # nats by which a step must help, per effective sample


@dataclass(frozen=True)
class MotionSegment:
    """Unbroken samples of one recording.

    Attributes:
        motion: what was commanded.
        q: what the encoders told [rad], shape (S, n).
        name: of the recording.
        counted: the first sample that errors count; before it the simulation finds its way.
        wrong: samples of the recording that were left out, as no motion reaches them, by joint.
    """

    motion: Motion
    q: Array
    name: str = ""
    counted: int = 0
    wrong: tuple[int, ...] = ()


@dataclass(frozen=True)
class Setup:
    """All that a fit holds fixed.

    Attributes:
        chain, delta: the links.
        at_link: whether each joint's encoder sits behind the gears, shape (n,).
        segments: the recordings.
        step: longest step of the simulation [s].
    """

    chain: Chain
    delta: Array
    at_link: NDArray[np.bool_]
    segments: tuple[MotionSegment, ...]
    step: float

    @property
    def seconds(self) -> float:
        """Length of all recordings."""
        return sum(float(s.motion.t[-1] - s.motion.t[0]) for s in self.segments)

    def replay(self, settings: Array) -> list[Array]:
        """Simulated positions along each segment, shape (S, n) each [rad]."""
        made = []
        for segment in self.segments:
            out = np.empty_like(segment.q)
            simulate(self.chain, self.delta, settings, self.at_link, segment.motion, self.step, out)
            made.append(np.clip(np.nan_to_num(out, nan=_AWAY), -_AWAY, _AWAY))
        return made

    def residuals(self, settings: Array) -> Array:
        """Measured less simulated positions, all segments stacked [rad], shape (S, n)."""
        pairs = zip(self.segments, self.replay(settings), strict=True)
        return np.concatenate([s.q[s.counted :] - m[s.counted :] for s, m in pairs])


@dataclass(frozen=True)
class Prior:
    """What is believed before the data: where coordinates lie, and how alike joints are.

    Attributes:
        center: settings around which they lie, shape (quantities, n).
        sd: of each coordinate, shape (quantities, n).
        alike: of the difference of a coordinate from its mean over joints, shape (quantities,);
            inf: not.
    """

    center: Array
    sd: Array
    alike: Array


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


def coordinates(settings: Array) -> Array:
    """Settings as a fit moves them: logarithms, or in units of their scale."""
    rows = [
        np.log(row) if q.scale == 0.0 else row / q.scale
        for q, row in zip(QUANTITIES, settings / _units(settings[_STIFFNESS]), strict=True)
    ]
    return np.array(rows)


def settings_at(place: Array) -> Array:
    """The settings at coordinates, inside their bounds."""
    rows = [
        np.exp(np.clip(row, -60, 60)) if q.scale == 0.0 else row * q.scale
        for q, row in zip(QUANTITIES, place, strict=True)
    ]
    low, high = bounds()
    stiffness = np.clip(rows[_STIFFNESS], low[_STIFFNESS], high[_STIFFNESS])
    return np.clip(rows * _units(stiffness), low, high)


def turned(settings: Array, rows: NDArray[np.int64]) -> Array:
    """Change of a joint's settings per coordinate, shape (p, p).

    Args:
        settings: of the joint, shape (quantities,).
        rows: which of them, shape (p,).
    """
    units = _units(settings[_STIFFNESS : _STIFFNESS + 1])[rows, 0]
    scales = np.array([QUANTITIES[r].scale for r in rows])
    made = np.diag(np.where(scales == 0.0, settings[rows], scales * units))
    with_stiffness = [QUANTITIES[r].name in PER_STIFFNESS for r in rows]
    made[np.ix_(with_stiffness, rows == _STIFFNESS)] = settings[rows][with_stiffness, None]
    return made


def _units(stiffness: Array) -> Array:
    """What each quantity is measured in, the stiffness or nothing, shape (quantities, n)."""
    part = stiffness / QUANTITIES[_STIFFNESS].first
    return np.array([part if q.name in PER_STIFFNESS else np.ones_like(part) for q in QUANTITIES])


def bounds() -> tuple[Array, Array]:
    """The least and the greatest value of each quantity, shape (quantities, 1) each."""
    return np.array([[q.low] for q in QUANTITIES]), np.array([[q.high] for q in QUANTITIES])


def columns(setup: Setup, settings: Array, free: NDArray[np.bool_], reach: float = NEAR) -> Array:
    """Change of the simulated positions per coordinate, shape (p, S, n), p free ones by rows.

    Changes are made to both sides: the bend of large columns otherwise passes for knowledge where
    they all but cancel, as along a common factor of all torques. Steps are coarse ones, whose error
    is alike.

    Args:
        setup: arm and recordings.
        settings: around which, shape (quantities, n).
        free: of which settings, shape (quantities, n).
        reach: size of the changes, as a part of the largest that a fit makes.
    """
    setup = replace(setup, step=max(setup.step, SLOPE_STEP_S))
    pairs = np.argwhere(free)
    made = []
    for row in np.unique(pairs[:, 0]):
        joints = np.flatnonzero(free[row]).tolist()
        alone = QUANTITIES[row].name in _REACHING
        for group in [[j] for j in joints] if alone else [joints]:
            (ahead, up), (behind, down) = (
                _nudged(settings, row, group, side) for side in (reach, -reach)
            )
            change = setup.residuals(behind) - setup.residuals(ahead)
            for j in group:
                own = change if alone else np.where(np.arange(len(up)) == j, change, 0.0)
                made.append(own / (up - down)[j])
    return np.array(made)


def _nudged(settings: Array, row: int, group: list[int], reach: float) -> tuple[Array, Array]:
    """Settings with one quantity of some joints changed inside its bounds, and by how much.

    The second is in coordinates, shape (n,).
    """
    place = coordinates(settings)
    moved = place.copy()
    moved[row, group] += reach * (_NUDGE if QUANTITIES[row].scale == 0.0 else _PART)
    changed = settings_at(moved)
    return changed, coordinates(changed)[row] - place[row]


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
        hessian, slope = _pull(settings, free, prior)
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
            trial = np.where(looking, settings_at(moved), settings)
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
    hessian, slope = _pull(settings, free, prior)
    off = np.linalg.solve(hessian, slope)
    return float(fitting + off @ slope)


def _pull(settings: Array, free: NDArray[np.bool_], prior: Prior) -> tuple[Array, Array]:
    """Hessian and downhill slope of half the prior's cost, by free coordinate."""
    pairs = np.argwhere(free)
    rows, joints = pairs.T
    away = coordinates(settings)[rows, joints] - coordinates(prior.center)[rows, joints]
    hessian = np.diag(prior.sd[rows, joints] ** -2.0)
    for row in np.unique(rows):
        mine = rows == row
        count = int(mine.sum())
        if np.isfinite(prior.alike[row]) and count > 1:
            spread = (np.eye(count) - 1.0 / count) / prior.alike[row] ** 2
            hessian[np.ix_(mine, mine)] += spread
    return hessian, -hessian @ away
