"""The optimisation problem: objective and constraints of a series, with exact gradients."""

from dataclasses import dataclass, replace

import numpy as np

from ident.dynamics.regressor import Motion
from ident.dynamics.regressor_adjoint import regressor_vjp
from ident.excitation.problem import constraints as limited
from ident.excitation.problem.closed_loop_trial import ClosedLoopTrial
from ident.excitation.problem.constraints import Adjoints, Constraints
from ident.excitation.problem.criterion import (
    Objective,
    aimed,
    gram,
    gram_vjp,
    sharp_value,
    value_and_slope,
    value_and_slopes,
)
from ident.excitation.problem.noise_model import Noise
from ident.excitation.problem.regressor_columns import Columns, exact_rows, smooth_rows
from ident.excitation.problem.trajectory_grid import Grid
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Problem:
    """What a design optimises.

    Attributes:
        columns: the wanted columns of W.
        objective: what to minimise.
        constraints: the arm's limits.
        grid: samples of one period.
        noise: of the torques.
        trial: shows the noise of motions that compete; None: the formula is all there is.
    """

    columns: Columns
    objective: Objective
    constraints: Constraints
    grid: Grid
    noise: Noise
    trial: ClosedLoopTrial | None = None


@dataclass(frozen=True)
class Smoothness:
    """How closely the smooth problem follows the sharp one.

    Attributes:
        power: of the norm that stands in for the extreme singular values.
        softness_rad_s: width of the smoothed sign of velocity [rad/s].
    """

    power: float
    softness_rad_s: float


@dataclass(frozen=True)
class Penalty:
    """Multipliers and stiffness of the augmented Lagrangian.

    Attributes:
        multipliers: one for each constraint, shape (M,).
        stiffness: what a violation costs.
    """

    multipliers: Array
    stiffness: float


def lagrangian(
    problem: Problem, coefficients: Array, smoothness: Smoothness, penalty: Penalty
) -> tuple[float, Array, Array]:
    """Objective with the price of violated limits (Nocedal and Wright 2006, section 17.3).

    Args:
        problem: objective, constraints and grid.
        coefficients: shape (2 L + 1, n).
        smoothness: of objective and friction.
        penalty: multipliers and stiffness.

    Returns:
        The value; its gradient, of the coefficients' shape; the multipliers' estimates, shape (M,).
    """
    motion, rows, found = _evaluate(problem, coefficients, smoothness.softness_rad_s)
    value, bar, by_noise = _objective(problem, motion, rows, smoothness.power)
    multiplier = multipliers(problem, found, penalty)
    samples = problem.grid.samples
    value += float(multiplier @ multiplier - penalty.multipliers @ penalty.multipliers) / (
        2.0 * penalty.stiffness * samples
    )
    zeros = np.zeros((2, *motion.q.shape))
    adjoints = Adjoints(zeros[0], *by_noise, zeros[1], bar)
    soft = smoothness.softness_rad_s
    limited.constraints_vjp(
        problem.constraints, problem.columns, motion, multiplier / samples, soft, adjoints
    )
    return value, _motion_vjp(problem, motion, soft, adjoints), multiplier


def _objective(
    problem: Problem, motion: Motion, rows: Array, power: float
) -> tuple[float, Array, tuple[Array, Array]]:
    """The smooth objective; its gradient by the rows, and by velocity and acceleration as noise."""
    columns, noise, objective = problem.columns, problem.noise, problem.objective
    found = gram(columns, rows)
    if objective.kind == "condition":
        value, slope = value_and_slope(objective, found, power)
        return (
            value,
            gram_vjp(columns, rows, slope),
            (np.zeros_like(motion.qd), np.zeros_like(motion.qd)),
        )
    variance = noise.variance(motion)
    noisy = gram(columns, np.sqrt(variance)[:, :, None] * rows)
    value, slope, noisy_slope = value_and_slopes(objective, found, noisy, power)
    pulled = gram_vjp(columns, rows, noisy_slope)
    bar = gram_vjp(columns, rows, slope) + variance[:, :, None] * pulled
    by_variance = np.sum(rows * pulled, axis=2) / 2.0
    qd, qdd = (np.ascontiguousarray((by_variance * by).T) for by in noise.slopes(motion))
    return value, bar, (qd, qdd)


def smoothed_problem(problem: Problem, coefficients: Array, smoothness: Smoothness) -> Problem:
    """The problem whose smooth objective has its bound where the sharp one has it, near a motion.

    Args:
        problem: objective, constraints and grid.
        coefficients: shape (2 L + 1, n).
        smoothness: of objective and friction.
    """
    columns, motion = problem.columns, problem.grid.motion(coefficients)
    found = gram(columns, smooth_rows(columns, motion, smoothness.softness_rad_s))
    rows = exact_rows(columns, motion)
    return replace(problem, objective=aimed(problem.objective, found, rows, smoothness.power))


def multipliers(problem: Problem, found: Array, penalty: Penalty) -> Array:
    """First-order estimates of the multipliers, shape (M,), for constraint values `found`."""
    lower = limited.lower_bounds(problem.constraints, problem.grid.samples)
    pushed = found + penalty.multipliers / penalty.stiffness
    return penalty.stiffness * (pushed - np.clip(pushed, lower, 1.0))


def constraint_values(problem: Problem, coefficients: Array, softness_rad_s: float) -> Array:
    """All limited quantities of a series in units of their bounds, shape (M,)."""
    return _evaluate(problem, coefficients, softness_rad_s)[2]


def objective_value(problem: Problem, coefficients: Array, samples: Grid) -> float:
    """The sharp objective on a grid: exact sign, true singular values."""
    motion = samples.motion(coefficients)
    rows, variance = exact_rows(problem.columns, motion), problem.noise.variance(motion)
    return sharp_value(problem.objective, rows, variance.T.ravel())


def _evaluate(
    problem: Problem, coefficients: Array, softness_rad_s: float
) -> tuple[Motion, Array, Array]:
    motion = problem.grid.motion(coefficients)
    jerk = problem.grid.jerk @ coefficients
    rows = smooth_rows(problem.columns, motion, softness_rad_s)
    found = limited.values(problem.constraints, problem.columns, motion, jerk, rows, softness_rad_s)
    return motion, rows, found


def _motion_vjp(
    problem: Problem, motion: Motion, softness_rad_s: float, adjoints: Adjoints
) -> Array:
    """Gradient by the coefficients of all that the adjoints hold."""
    columns = problem.columns
    for i, kind, joint in columns.own:
        bar = adjoints.rows[joint, :, i]
        if kind == "fv":
            adjoints.qd[:, joint] += bar
        elif kind == "fc":
            slip = np.tanh(motion.qd[:, joint] / softness_rad_s)
            adjoints.qd[:, joint] += bar * (1.0 - slip**2) / softness_rad_s
        elif kind == "ia":
            adjoints.qdd[:, joint] += bar
    regressor_vjp(
        columns.frames,
        motion.q,
        motion.qd,
        motion.qdd,
        adjoints.rows,
        adjoints.q,
        adjoints.qd,
        adjoints.qdd,
    )
    g = problem.grid
    return (
        g.position.T @ adjoints.q
        + g.velocity.T @ adjoints.qd
        + g.acceleration.T @ adjoints.qdd
        + g.jerk.T @ adjoints.qddd
    )
