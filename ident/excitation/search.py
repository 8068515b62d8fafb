"""From many starts to one design: a few good motions, and changes of parts of them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.excitation.columns import exact_rows
from ident.excitation.deadline import Deadline
from ident.excitation.descent import FROM_AFAR, FROM_NEARBY, TO_THE_POINT, descend
from ident.excitation.fit import fit, fit_joints
from ident.excitation.grid import Grid
from ident.excitation.objective import sharp_value
from ident.excitation.problem import Problem

Array = NDArray[np.floating]

_KEPT = 6
_STARTS = 8
_POLISH_SHARE = 0.15
_DIFFERENT = 0.1
_CENTRAL = 0.15
"""Starts are centred at least this part of the range away from its ends."""

_WILD_RAD_S = 5.0


@dataclass(frozen=True)
class Candidate:
    """A motion within its limits.

    Attributes:
        value: of the sharp objective; the logarithm of the condition number, for example.
        condition_number: of W, whatever the objective.
        coefficients: shape (2 L + 1, n).
    """

    value: float
    condition_number: float
    coefficients: Array


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
    """Every better design as it is found, the polished one last.

    Args:
        problem: objective, constraints and the grid to optimise on.
        dense: grid on which limits and objective are judged.
        effort: when to stop.
        seed: of the random starts and changes.
        start: a design to improve, shape (2 L + 1, n), instead of starting afresh.
    """
    rng = np.random.default_rng(seed)
    soon = effort.deadline.sooner(_POLISH_SHARE)
    judged = replace(problem, grid=dense)
    kept: list[Candidate] = [] if start is None else _judge(judged, start)
    yield from kept
    best, idle = min((c.value for c in kept), default=np.inf), 0
    for count in range(effort.descents):
        if soon.over or (kept and idle >= effort.patience):
            break
        afar = count < (_STARTS if start is None else 1)
        if start is not None and count == 0:
            first = start
        elif afar or not kept:
            first = random_start(problem, rng)
        else:
            first = _changed(problem, kept, rng)
        stages = FROM_AFAR if afar else FROM_NEARBY
        found = _judge(judged, descend(problem, first, stages, soon))
        kept = _keep(kept + found)
        idle = 0 if kept and kept[0].value < best - effort.gain else idle + 1
        if kept and kept[0].value < best:
            best = kept[0].value
            yield kept[0]
    if kept:
        polished = _judge(
            judged, descend(problem, kept[0].coefficients, TO_THE_POINT, effort.deadline)
        )
        yield from [c for c in polished if c.value < best]


def random_start(problem: Problem, rng: np.random.Generator) -> Array:
    """A motion whose joints use their limits, torque, speed and clearance aside."""
    middle, half = problem.constraints.bounds.middle, problem.constraints.bounds.kinematic[0]
    shape = (problem.grid.position.shape[1], len(middle))
    wild = _WILD_RAD_S * rng.normal(size=shape)
    wild[-1] = middle + half * rng.uniform(2 * _CENTRAL - 1, 1 - 2 * _CENTRAL, shape[1])
    return fit_joints(problem, problem.grid, wild)


def _judge(judged: Problem, coefficients: Array) -> list[Candidate]:
    """The design within its limits, or nothing where it cannot be brought there."""
    fitted = fit(judged, coefficients)
    if fitted is None:
        return []
    return [candidate(judged, fitted)]


def candidate(judged: Problem, coefficients: Array) -> Candidate:
    """A motion with what it is worth on the problem's grid."""
    motion = judged.grid.motion(coefficients)
    rows, variance = exact_rows(judged.columns, motion), judged.noise.variance(motion)
    value = sharp_value(judged.objective, rows, variance.T.ravel())
    return Candidate(value, float(np.linalg.cond(rows)), coefficients)


def _keep(candidates: list[Candidate]) -> list[Candidate]:
    """The best few that differ from each other, best first."""
    kept: list[Candidate] = []
    for c in sorted(candidates, key=lambda c: c.value):
        gaps = [np.abs(c.coefficients - k.coefficients).max() for k in kept]
        if min(gaps, default=np.inf) > _DIFFERENT:
            kept.append(c)
    return kept[:_KEPT]


def _changed(problem: Problem, kept: list[Candidate], rng: np.random.Generator) -> Array:
    """One of the kept motions with a part of it changed."""
    changed = kept[rng.integers(len(kept))].coefficients.copy()
    joint = rng.integers(changed.shape[1])
    change = _CHANGES[rng.integers(len(_CHANGES))]
    other = kept[rng.integers(len(kept))].coefficients
    change(changed, other, joint, rng)
    return fit_joints(problem, problem.grid, changed)


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
