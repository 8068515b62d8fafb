"""From many starts to one design: a few good motions, and changes of parts of them."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ident.excitation.optimisation.augmented_lagrangian import (
    COARSE_STAGES,
    FINAL_STAGES,
    FINE_STAGES,
    descend,
)
from ident.excitation.optimisation.deadline import Deadline
from ident.excitation.optimisation.evaluate import POOL, Candidate, Judge
from ident.excitation.optimisation.scale_into_limits import scale_joints_into_limits
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.regressor_columns import smooth_rows
from ident.excitation.problem.trajectory_grid import Grid
from ident.signals.arrays import Array

_STARTS = 8
_START_SHARE = 0.5
"""Of the time, at most, for descents from random starts; one is made in any case."""

_DRAWN = 200
"""Random motions of each joint, of which a start has the best."""

_POLISH_SHARE = 0.1
_TOGETHER_SHARE = 0.65
"""Of the time, for the best of all families."""

_STALE = 8
"""A family that has not become better for so many descents gives way to the next."""

_DIFFERENT = 0.1
_CENTRAL = 0.15
"""Starts are centred at least this part of the range away from its ends."""

_WILD_RAD_S = 5.0
_SHARP_RAD_S = 0.02


_Kept = Generator[Candidate, None, list[Candidate]]


@dataclass(frozen=True)
class Effort:
    """When to stop.

    Attributes:
        deadline: when the time is over.
        descents: how many descents at most.
        patience: this many descents without `gain` end the search.
        gain: least improvement of the objective that counts.
    """

    deadline: Deadline
    descents: int
    patience: int
    gain: float


def search(
    problem: Problem, dense: Grid, effort: Effort, seed: int, start: Array | None
) -> Iterator[Candidate]:
    """Every better design as it is found.

    Args:
        problem: objective, constraints and the grid to optimise on.
        dense: grid on which limits and objective are judged.
        effort: when to stop.
        seed: of the random starts and changes.
        start: a design to improve, shape (2 L + 1, n), instead of starting afresh.
    """
    population = _Population(problem, dense, effort, np.random.default_rng(seed))
    best = np.inf
    for found in population.polished(start) if problem.trial is None else population.tried(start):
        if found.value < best:
            best = found.value
            yield found


class _Population:
    """Motions that descend from each other."""

    def __init__(
        self, problem: Problem, dense: Grid, effort: Effort, rng: np.random.Generator
    ) -> None:
        self._problem, self._dense, self._effort, self._rng = problem, dense, effort, rng
        self._descents = 0

    def polished(self, start: Array | None) -> Iterator[Candidate]:
        """One family, and the best of it with all digits."""
        end = self._effort.deadline
        kept = yield from self._family(start, end.sooner(_POLISH_SHARE), self._effort.patience)
        if kept:
            last = descend(self._problem, kept[0].coefficients, FINAL_STAGES, end)
            yield from self._judge(self._problem, end).of(last, kept)

    def tried(self, start: Array | None) -> Iterator[Candidate]:
        """One family after the other, and then the best of all together."""
        soon = self._effort.deadline.sooner(_TOGETHER_SHARE)
        best = yield from self._family(start, soon, _STALE)
        while self._goes_on(soon):
            more = yield from self._family(start, soon, _STALE)
            best = _keep(best + more)
        end, patience = self._effort.deadline, self._effort.patience
        yield from self._improve(best, iter(()), end, patience)

    def _family(self, start: Array | None, deadline: Deadline, patience: int) -> _Kept:
        """Random starts, or one that is given, and changes of them; gives the best few."""
        given = [] if start is None else [start]
        firsts = self._starts(deadline) if start is None else iter(given)
        judge, kept = self._judge(self._problem, deadline), list[Candidate]()
        for coefficients in given:
            kept = _keep(kept + judge.of(coefficients, kept))
        return (yield from self._improve(kept, firsts, deadline, patience))

    def _starts(self, deadline: Deadline) -> Iterator[Array]:
        """Random motions with a good condition number, for a part of the time."""
        objective = self._problem.objective
        if np.isfinite(objective.most):
            objective = replace(objective, kind="condition", most=np.inf)
        aim = replace(self._problem, objective=objective)
        early = deadline.sooner(1.0 - _START_SHARE)
        for number in range(_STARTS):
            if early.over and number > 0:
                break
            wild = random_start(self._problem, self._rng)
            yield descend(aim, wild, COARSE_STAGES, deadline)

    def _improve(
        self, kept: list[Candidate], firsts: Iterator[Array], deadline: Deadline, patience: int
    ) -> _Kept:
        """Descents from first motions, then from changes of the best; gives those.

        Args:
            kept: motions to begin with, best first.
            firsts: motions to descend from.
            deadline: when to stop.
            patience: so many descents without gain end it.
        """
        judge = self._judge(self._problem, deadline)
        yield from kept[:1]
        idle = 0
        while self._goes_on(deadline) and not (kept and idle >= patience):
            best = kept[0].value if kept else np.inf
            first = next(firsts, None)
            if first is None:
                first = (
                    _changed(self._problem, kept, self._rng)
                    if kept
                    else random_start(self._problem, self._rng)
                )
            self._descents += 1
            found = descend(self._problem, first, FINE_STAGES, deadline)
            kept = _keep(kept + judge.of(found, kept))
            idle = 0 if kept and kept[0].value < best - self._effort.gain else idle + 1
            if kept and kept[0].value < best:
                yield kept[0]
        return kept

    def _goes_on(self, deadline: Deadline) -> bool:
        return self._descents < self._effort.descents and not deadline.over

    def _judge(self, aim: Problem, deadline: Deadline) -> Judge:
        return Judge(replace(aim, grid=self._dense), deadline)


def random_start(problem: Problem, rng: np.random.Generator) -> Array:
    """A motion whose joints use their limits, torque, speed and clearance aside.

    Of many random ones each joint has the one that shows its own parameters best: they are what the
    smallest singular values of W see, and other joints' motion hardly changes them.
    """
    drawn = np.array([_wild(problem, rng) for _ in range(_DRAWN)])
    seen = np.array([_own_singular_values(problem, motion) for motion in drawn])
    joints = np.arange(drawn.shape[2])
    return drawn[seen.argmax(axis=0), :, joints].T


def _wild(problem: Problem, rng: np.random.Generator) -> Array:
    middle, half = problem.constraints.bounds.middle, problem.constraints.bounds.kinematic[0]
    shape = (problem.grid.position.shape[1], len(middle))
    wild = _WILD_RAD_S * rng.normal(size=shape)
    wild[-1] = middle + half * rng.uniform(2 * _CENTRAL - 1, 1 - 2 * _CENTRAL, shape[1])
    return scale_joints_into_limits(problem, problem.grid, wild)


def _own_singular_values(problem: Problem, coefficients: Array) -> Array:
    """The smallest one of each joint's own columns, such as its friction's, shape (n,)."""
    columns = problem.columns
    rows = smooth_rows(columns, problem.grid.motion(coefficients), _SHARP_RAD_S)
    own = [[i for i, _, of in columns.own if of == joint] for joint in range(len(rows))]
    pairs = zip(rows, own, strict=True)
    return np.array(
        [np.linalg.svd(r[:, c], compute_uv=False).min(initial=np.inf) for r, c in pairs]
    )


def _keep(candidates: list[Candidate]) -> list[Candidate]:
    """The best few that differ from each other, best first."""
    kept: list[Candidate] = []
    for c in sorted(candidates, key=lambda c: c.value):
        gaps = [np.abs(c.coefficients - k.coefficients).max() for k in kept]
        if min(gaps, default=np.inf) > _DIFFERENT:
            kept.append(c)
    return kept[:POOL]


def _changed(problem: Problem, kept: list[Candidate], rng: np.random.Generator) -> Array:
    """One of the kept motions, a good one more often, with a part of it changed."""
    changed = kept[rng.integers(len(kept), size=2).min()].coefficients.copy()
    joint = rng.integers(changed.shape[1])
    change = _CHANGES[rng.integers(len(_CHANGES))]
    other = kept[rng.integers(len(kept))].coefficients
    change(changed, other, joint, rng)
    return scale_joints_into_limits(problem, problem.grid, changed)


def _shake(x: Array, other: Array, joint: int, rng: np.random.Generator) -> None:
    x += rng.choice([0.05, 0.1, 0.2]) * rng.normal(size=x.shape)


def _renew(x: Array, other: Array, joint: int, rng: np.random.Generator) -> None:
    x[:-1, joint] = rng.normal(size=len(x) - 1)


def _vary(x: Array, other: Array, joint: int, rng: np.random.Generator) -> None:
    x[:-1, joint] += 0.4 * rng.normal(size=len(x) - 1)


def _exchange(x: Array, other: Array, joint: int, rng: np.random.Generator) -> None:
    x[:, joint] = other[:, joint]
    x[:-1] += 0.05 * rng.normal(size=x[:-1].shape)


def _delay(x: Array, other: Array, joint: int, rng: np.random.Generator) -> None:
    harmonics = len(x) // 2
    phase = rng.uniform(0, 2 * np.pi) * np.arange(1, harmonics + 1)
    a, b = x[:harmonics, joint].copy(), x[harmonics:-1, joint].copy()
    x[:harmonics, joint] = a * np.cos(phase) + b * np.sin(phase)
    x[harmonics:-1, joint] = b * np.cos(phase) - a * np.sin(phase)


_CHANGES: tuple[Callable[[Array, Array, int, np.random.Generator], None], ...] = (
    _shake,
    _renew,
    _vary,
    _delay,
    *[_exchange] * 4,
)
"""Joints of other good motions have helped most often."""
