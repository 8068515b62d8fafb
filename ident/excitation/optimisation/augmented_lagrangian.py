"""From a start to the nearest optimum: augmented Lagrangian around L-BFGS, in stages."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ident.excitation.optimisation.deadline import Deadline
from ident.excitation.problem.design_problem import (
    Penalty,
    Problem,
    Smoothness,
    constraint_values,
    lagrangian,
    multipliers,
    smoothed_problem,
)
from ident.signals.arrays import Array

_SCALE = 0.5
"""Typical size of a coefficient [rad/s or rad], in which L-BFGS sees them."""

_MEMORY = 30


@dataclass(frozen=True)
class Stage:
    """A stretch of the descent.

    Attributes:
        smoothness: of objective and friction.
        stiffness: what a violation costs.
        iterations: of L-BFGS, at most.
    """

    smoothness: Smoothness
    stiffness: float
    iterations: int


COARSE_STAGES = (
    Stage(Smoothness(8.0, 0.1), 100.0, 100),
    Stage(Smoothness(32.0, 0.1), 300.0, 100),
)
"""For a start that nobody has chosen: smooth, so that it does not stick at once."""

FINE_STAGES = (
    Stage(Smoothness(32.0, 0.05), 300.0, 80),
    Stage(Smoothness(64.0, 0.02), 1000.0, 80),
    Stage(Smoothness(64.0, 0.02), 1000.0, 80),
)
"""For what the coarse ones leave, and for a good design of which a part was changed."""

FINAL_STAGES = (
    Stage(Smoothness(200.0, 0.02), 1000.0, 200),
    Stage(Smoothness(200.0, 0.02), 3000.0, 200),
)
"""For the best design: close to the sharp objective."""


def descend(
    problem: Problem, coefficients: Array, stages: Sequence[Stage], deadline: Deadline
) -> Array:
    """The optimum near a start, shape (2 L + 1, n); limits may be passed by a little.

    Args:
        problem: objective, constraints and grid.
        coefficients: the start, shape (2 L + 1, n).
        stages: one after another; multipliers are kept between them.
        deadline: when to stop.
    """
    shape = coefficients.shape
    x = coefficients.ravel() / _SCALE
    multiplier = None
    for stage in stages:
        if deadline.over:
            break
        soft = stage.smoothness.softness_rad_s
        found = constraint_values(problem, x.reshape(shape) * _SCALE, soft)
        multiplier = np.zeros_like(found) if multiplier is None else multiplier
        penalty = Penalty(multiplier, stage.stiffness)
        aim = smoothed_problem(problem, x.reshape(shape) * _SCALE, stage.smoothness)
        x = _minimise(aim, x, shape, stage, penalty, deadline)
        found = constraint_values(problem, x.reshape(shape) * _SCALE, soft)
        multiplier = multipliers(problem, found, penalty)
    return x.reshape(shape) * _SCALE


def _minimise(
    problem: Problem,
    x: Array,
    shape: tuple[int, ...],
    stage: Stage,
    penalty: Penalty,
    deadline: Deadline,
) -> Array:
    def value_and_gradient(x: Array) -> tuple[float, Array]:
        coefficients = x.reshape(shape) * _SCALE
        value, gradient, _ = lagrangian(problem, coefficients, stage.smoothness, penalty)
        return value, gradient.ravel() * _SCALE

    def stop_in_time(intermediate_result: object) -> None:
        if deadline.over:
            raise StopIteration

    options = {"maxiter": stage.iterations, "maxcor": _MEMORY}
    found = minimize(
        value_and_gradient, x, jac=True, method="L-BFGS-B", callback=stop_in_time, options=options
    )
    return found.x
