"""Bringing a motion within its limits by making it smaller, never by hoping."""

import numpy as np

from ident.excitation.problem.design_problem import Problem, constraint_values
from ident.excitation.problem.trajectory_grid import Grid
from ident.signals.arrays import Array

_SHARP_RAD_S = 1e-12
"""Friction counts in full, however slow the motion."""

_HALVINGS = 12
_HAIR = 1e-6
"""Left free against rounding."""


def fit(problem: Problem, coefficients: Array) -> Array | None:
    """The motion within the limits on the problem's grid, or None where its centre is not.

    Each joint is scaled about its centre until its own limits hold, and moved into its range;
    then all joints together until torque, speed and clearance hold.

    Args:
        problem: constraints and a dense grid.
        coefficients: shape (2 L + 1, n).
    """
    fitted = scale_joints_into_limits(problem, problem.grid, coefficients)
    if _within(problem, fitted):
        return fitted
    low, high = 0.0, 1.0
    if not _within(problem, scaled(fitted, _HAIR)):
        return None
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if _within(problem, scaled(fitted, middle)) else (low, middle)
    return scaled(fitted, max(low, _HAIR))


def scale_joints_into_limits(problem: Problem, samples: Grid, coefficients: Array) -> Array:
    """Each joint by itself within range, velocity, acceleration and jerk on a grid."""
    middle = problem.constraints.bounds.middle
    half, *rates = problem.constraints.bounds.kinematic * (1.0 - _HAIR)
    swing = samples.position[:, :-1] @ coefficients[:-1]
    derivatives = (samples.velocity, samples.acceleration, samples.jerk)
    peaks = [np.abs(d @ coefficients).max(axis=0) for d in derivatives]
    uses = [peak / rate for peak, rate in zip(peaks, rates, strict=True)]
    uses.append(np.ptp(swing, axis=0) / (2 * half))
    factor = 1.0 / np.maximum(1.0, np.max(uses, axis=0))
    swing = swing * factor
    fitted = coefficients.copy()
    fitted[:-1] *= factor
    low, high = middle - half - swing.min(axis=0), middle + half - swing.max(axis=0)
    fitted[-1] = np.minimum(np.maximum(fitted[-1], low), high)
    return fitted


def scaled(coefficients: Array, factor: float) -> Array:
    """The same motion made smaller about its centre."""
    smaller = coefficients.copy()
    smaller[:-1] *= factor
    return smaller


def _within(problem: Problem, coefficients: Array) -> bool:
    return float(constraint_values(problem, coefficients, _SHARP_RAD_S).max()) <= 1.0
