"""The paper's way (V-A): constrained optimisation by linear approximation, from one start."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ident.excitation.optimisation.evaluate import Candidate, candidate
from ident.excitation.optimisation.scale_into_limits import fit
from ident.excitation.optimisation.search import Effort, random_start
from ident.excitation.problem.design_problem import Problem, constraint_values, objective_value
from ident.excitation.problem.trajectory_grid import Grid

Array = NDArray[np.floating]

_FIRST_STEP = 0.1
_SHARP_RAD_S = 1e-12
_TOLERANCE = 1e-3


class _TimeOverError(Exception):
    """Ends COBYLA, which has no clock of its own."""


def search_by_cobyla(
    problem: Problem, dense: Grid, effort: Effort, seed: int, start: Array | None
) -> Iterator[Candidate]:
    """The start, and what COBYLA makes of it.

    Each limit of each joint is one constraint: its largest value on the grid.

    Args:
        problem: objective, constraints and the grid to optimise on.
        dense: grid on which limits and objective are judged.
        effort: when to stop; patience and gain do not apply.
        seed: of the random start.
        start: where to begin, shape (2 L + 1, n); None begins at a random motion.
    """
    judged = replace(problem, grid=dense)
    first = random_start(problem, np.random.default_rng(seed)) if start is None else start
    fitted = fit(judged, first)
    if fitted is None:
        return
    yield candidate(judged, fitted)
    last = fit(judged, _run(problem, fitted, effort))
    if last is not None:
        yield candidate(judged, last)


def _run(problem: Problem, start: Array, effort: Effort) -> Array:
    """The best motion on COBYLA's way that keeps its limits, but for a thousandth."""
    best, lowest = start, np.inf

    def value(x: Array) -> float:
        nonlocal best, lowest
        if effort.deadline.over:
            raise _TimeOverError
        here = x.reshape(start.shape).copy()
        found = objective_value(problem, here, problem.grid)
        if found < lowest and _worst(problem, here).max() < 1.0 + _TOLERANCE:
            best, lowest = here, found
        return found

    def room(x: Array) -> Array:
        return 1.0 - _worst(problem, x.reshape(start.shape))

    constraints = {"type": "ineq", "fun": room}
    options = {"rhobeg": _FIRST_STEP, "maxiter": effort.descents}
    with suppress(_TimeOverError):
        minimize(value, start.ravel(), method="COBYLA", constraints=constraints, options=options)
    return best


def _worst(problem: Problem, coefficients: Array) -> Array:
    """Largest use of each limit over the grid: kinematic and torque by joint, speeds, nearness."""
    found = constraint_values(problem, coefficients, _SHARP_RAD_S)
    samples, n = problem.grid.samples, coefficients.shape[1]
    points = len(problem.constraints.bounds.speed)
    by_joint, speed, nearness = np.split(found, np.cumsum([5 * samples * n, points * samples]))
    joints = np.abs(by_joint.reshape(5, samples, n)).max(axis=1).ravel()
    nearest = nearness.max(initial=-1.0)
    return np.concatenate([joints, speed.reshape(samples, points).max(axis=0), [nearest]])
