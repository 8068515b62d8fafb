"""Compiled rows, speeds and distances against Pinocchio and coal; gradients by differences."""

from dataclasses import replace

import numpy as np
import pytest

from ident.dynamics.regressor import Motion
from ident.dynamics.regressor_adjoint import fill_rows, regressor_vjp
from ident.excitation.design import DesignTask
from ident.excitation.optimisation.evaluate import candidate
from ident.excitation.optimisation.search import random_start
from ident.excitation.problem import clearance as geometry
from ident.excitation.problem.constraints import lower_bounds
from ident.excitation.problem.criterion import Objective, sharp_value
from ident.excitation.problem.design_problem import (
    Penalty,
    Problem,
    Smoothness,
    lagrangian,
    smoothed_problem,
)
from ident.excitation.problem.noise_model import Noise
from ident.excitation.settings import Kind
from wamctl.arm.collision import collision_shapes
from wamctl.arm.collision import distances as coal_distances
from wamctl.arm.motion import point_speeds
from wamctl.arm.robot import regressor

STEP = 1e-6


def test_rows_are_pinocchios(problem: Problem, rng: np.random.Generator) -> None:
    q, qd, qdd = rng.normal(size=(3, 20, 7))
    frames, links = problem.columns.frames, problem.columns.links
    rows = np.zeros((7, 20, links))
    fill_rows(frames, q, qd, qdd, rows)
    wanted = regressor(problem.columns.robot, q, qd, qdd)[:, :, np.flatnonzero(frames.column >= 0)]
    assert np.abs(rows - wanted.transpose(1, 0, 2)).max() < 1e-11


@pytest.mark.parametrize("part", [0, 1, 2])
def test_rows_pull_back(problem: Problem, rng: np.random.Generator, part: int) -> None:
    motion, direction = rng.normal(size=(3, 20, 7)), np.zeros((3, 20, 7))
    direction[part] = rng.normal(size=(20, 7))
    bar = rng.normal(size=(7, 20, problem.columns.links))
    adjoints = np.zeros((3, 20, 7))
    regressor_vjp(problem.columns.frames, *motion, bar, *adjoints)

    def value(moved: np.ndarray) -> float:
        rows = np.zeros_like(bar)
        fill_rows(problem.columns.frames, *moved, rows)
        return float((rows * bar).sum())

    change = value(motion + STEP * direction) - value(motion - STEP * direction)
    assert (adjoints * direction).sum() == pytest.approx(change / (2 * STEP), rel=1e-6)


def test_distances_are_coals(place: DesignTask, problem: Problem, rng: np.random.Generator) -> None:
    q = rng.uniform(-1.5, 1.5, (300, 7))
    shapes = problem.constraints.shapes
    found = np.empty((300, len(shapes.pairs)))
    geometry.distances(problem.constraints.chain, shapes, q, 10.0, found)
    wanted = coal_distances(place.robot, collision_shapes(place.robot), q)
    apart = wanted > 0
    assert apart.mean() > 0.9
    assert np.abs(found - wanted)[apart].max() < 1e-5


def test_speeds_are_pinocchios(
    place: DesignTask, problem: Problem, rng: np.random.Generator
) -> None:
    q, qd = rng.normal(size=(2, 50, 7))
    squares = np.empty((50, 2))
    geometry.point_speeds(problem.constraints.chain, problem.constraints.points, q, qd, squares)
    frames = (place.arm.limits.elbow_frame, place.arm.limits.tool_frame)
    assert np.sqrt(squares) == pytest.approx(point_speeds(place.robot, frames, q, qd))


@pytest.mark.parametrize(
    ("kind", "most"),
    [
        ("condition", np.inf),
        ("determinant", np.inf),
        ("errors", np.inf),
        ("balanced", np.inf),
        ("errors", 100.0),
    ],
)
def test_the_whole_gradient(
    full_problem: Problem, rng: np.random.Generator, kind: Kind, most: float
) -> None:
    weights = np.ones(len(full_problem.columns.parameters))
    weights[-5:] = 2.0
    problem = Problem(
        full_problem.columns,
        Objective(kind, weights, most),
        full_problem.constraints,
        full_problem.grid,
        full_problem.noise,
    )
    x = 1.2 * random_start(problem, rng)
    smooth, count = Smoothness(16.0, 0.05), len(lower_bounds(problem.constraints, 128))
    penalty = Penalty(np.zeros(count), 3.0)
    penalty = Penalty(0.7 * lagrangian(problem, x, smooth, penalty)[2], 3.0)
    _, gradient, multiplier = lagrangian(problem, x, smooth, penalty)
    assert (multiplier != 0).sum() > 50
    direction = rng.normal(size=x.shape)
    high = lagrangian(problem, x + STEP * direction, smooth, penalty)[0]
    low = lagrangian(problem, x - STEP * direction, smooth, penalty)[0]
    assert (gradient * direction).sum() == pytest.approx((high - low) / (2 * STEP), rel=1e-4)


def test_a_bound_on_the_condition_number_costs_only_above_it(rng: np.random.Generator) -> None:
    rows = rng.normal(size=(200, 4)) * [1.0, 1.0, 1.0, 20.0]
    free, condition = Objective("errors", np.ones(4)), float(np.linalg.cond(rows))
    alike = np.ones(len(rows))
    value = sharp_value(free, rows, alike)
    loose = sharp_value(replace(free, most=1.1 * condition), rows, alike)
    assert loose == pytest.approx(value, abs=1e-6)
    above = sharp_value(replace(free, most=condition / np.e), rows, alike)
    assert above == pytest.approx(value + 20.0)
    alone = Objective("condition", np.ones(4))
    assert sharp_value(alone, rows, alike) == pytest.approx(np.log(condition))


def test_errors_are_those_of_least_squares_under_that_noise(rng: np.random.Generator) -> None:
    rows, sd = rng.normal(size=(60, 3)), rng.uniform(0.1, 3.0, 60)
    solved = np.linalg.pinv(rows)
    scatter = solved @ (sd[:, None] * rng.normal(size=(60, 200_000)))
    value = sharp_value(Objective("errors", np.ones(3)), rows, sd**2)
    expected = np.log(scatter.std(axis=1) * np.sqrt(len(rows))).mean()
    assert value == pytest.approx(expected, abs=0.01)


def test_joints_that_turn_back_make_noise() -> None:
    noise = Noise.of_friction(np.array([2.0, 0.0]))
    none, slow, fast = np.zeros((1, 2)), np.array([[0.0, 0.0]]), np.array([[1.0, 1.0]])
    briskly = np.full((1, 2), 3.0)
    assert noise.variance(Motion(none, slow, briskly)).T[0] == pytest.approx([12.04, 0.04], 1e-4)
    assert noise.variance(Motion(none, fast, briskly)).T[0] == pytest.approx([0.04, 0.04])
    alike = Noise.of_friction(np.zeros(2)).variance(Motion(none, slow, briskly))
    assert alike == pytest.approx(1.0)


def test_near_a_motion_the_smooth_bound_lies_where_the_true_one_does(
    problem: Problem, rng: np.random.Generator
) -> None:
    """The smooth condition number is larger, and would keep the descent from what is allowed."""
    x, smooth = random_start(problem, rng), Smoothness(16.0, 0.1)
    none = Penalty(np.zeros(len(lower_bounds(problem.constraints, problem.grid.samples))), 1e-9)
    condition = candidate(problem, x).condition_number

    def price(most: float, aim: bool) -> float:
        values = []
        for objective in (
            Objective("errors", problem.objective.weights, m) for m in (most, np.inf)
        ):
            asked = replace(problem, objective=objective)
            asked = smoothed_problem(asked, x, smooth) if aim else asked
            values.append(lagrangian(asked, x, smooth, none)[0])
        return values[0] - values[1]

    assert price(1.05 * condition, aim=False) > 0.1
    assert price(1.05 * condition, aim=True) < 1e-3
    assert price(0.95 * condition, aim=True) > 0.1
