"""Motions tried out on the arm as a model has it, and what the search makes of it."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.dynamics.compiled_chain import chain_of
from ident.dynamics.parameters import standard_parameters
from ident.excitation.design import DesignTask, problem_of
from ident.excitation.optimisation import search as searching
from ident.excitation.optimisation.deadline import Deadline
from ident.excitation.optimisation.evaluate import POOL, UNSEEN, Judge, candidate
from ident.excitation.optimisation.scale_into_limits import scaled
from ident.excitation.optimisation.search import Effort, search
from ident.excitation.problem.closed_loop_trial import ClosedLoopTrial
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.trajectory_grid import coefficients_of, grid, series_of
from ident.excitation.settings import DesignSettings
from ident.model.arm import arm_from_file
from ident.model.fit_filter import Filter
from ident.model.identified_model import Model
from ident.recordings.loading import Reading
from ident.simulation.arm import simulated_arm
from ident.workflows.design import place_of
from ident.workflows.run import run_logs
from ident.workflows.simulate import simulate_model
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.robot import cad_parameters
from wamctl.arm.trajectory import Trajectory, read_trajectory, write_trajectory
from wamctl.arm.trajectory_check import expected_friction

FILE = Path("excitation-published-limits.yaml")
NEVER, AT_ONCE = Deadline(np.inf), Deadline(0.0)


@pytest.fixture(scope="module")
def place() -> DesignTask:
    """The arm as its file's CAD has it, with half of the friction that it expects."""
    found = place_of(FILE)
    viscous, coulomb = expected_friction(found.arm)
    cad = cad_parameters(found.robot)
    plant = simulated_arm(chain_of(found.robot), cad, 0.5 * viscous, 0.5 * coulomb)
    return replace(found, known=plant)


@pytest.fixture(scope="module")
def problem(place: DesignTask) -> Problem:
    return replace(problem_of(place, DesignSettings()), grid=grid(0.1 * np.pi, 5, 1000))


@pytest.fixture(scope="module")
def trial(problem: Problem) -> ClosedLoopTrial:
    assert problem.trial is not None
    return problem.trial


@pytest.fixture(scope="module")
def motion() -> np.ndarray:
    """The shipped one, which keeps these limits; shape (11, 7)."""
    return coefficients_of(read_trajectory("wam7-excitation.yaml").series)


def model_of(place: DesignTask) -> Model:
    """What `ident run` would write of that arm."""
    assert place.known is not None
    robot, terms = place.robot, arm_from_file(FILE, ()).terms
    values = dict(zip(robot.inertial_names, cad_parameters(robot), strict=True))
    for i in range(robot.dof):
        values[f"fv{i + 1}"], values[f"fc{i + 1}"] = place.known.viscous[i], place.known.coulomb[i]
    return Model(
        arm="wam7",
        estimator="feasible",
        robot=robot,
        terms=terms,
        delta=np.array([values[p.name] for p in standard_parameters(robot, terms)]),
        moving=np.ones(robot.dof, dtype=bool),
        base_parameters=(),
        filter=Filter(2.5, 3, 25.0, 25.0, True, 0.01),
        noise=np.zeros(robot.dof),
        logs=(),
    )


def errors(trial: ClosedLoopTrial, motion: np.ndarray) -> float:
    """On the first arm, the one of the model."""
    return next(trial.errors(motion))


def test_a_smaller_motion_has_larger_errors(trial: ClosedLoopTrial, motion: np.ndarray) -> None:
    assert errors(trial, scaled(motion, 0.5)) > errors(trial, motion) + np.log(1.2)


def test_a_motion_too_small_to_tell_has_no_errors(
    trial: ClosedLoopTrial, motion: np.ndarray
) -> None:
    with pytest.raises(DataError):
        errors(trial, scaled(motion, 1e-3))


def test_weights_count(trial: ClosedLoopTrial, motion: np.ndarray) -> None:
    friction = errors(replace(trial, weights={"fc": 1e9}), motion)
    one = errors(replace(trial, weights={"fc7": 1e9}), motion)
    assert len({errors(trial, motion), friction, one}) == 3
    assert one < friction  # the smallest joint's friction is known best


def test_the_other_arms_differ_a_little(place: DesignTask, trial: ClosedLoopTrial) -> None:
    first, *others = trial.plants
    assert first is place.known
    assert len(others) == 2
    for other in others:
        ratio = other.coulomb / first.coulomb
        assert (np.abs(np.log(ratio)) < 4 * 0.15).all()
        assert len(set(ratio)) == 7


def test_errors_are_those_of_a_run_on_the_simulated_arm(
    place: DesignTask, trial: ClosedLoopTrial, motion: np.ndarray, tmp_path: Path
) -> None:
    """`ident simulate` and `ident run` on one period of the same motion, reversals left out."""
    robot = place.robot
    model_of(place).save(tmp_path / "model.yaml")
    series = series_of(motion, robot.joint_names, 0.1 * np.pi)
    write_trajectory(tmp_path / "motion.yaml", Trajectory(series, 1, {}, {}))
    log = tmp_path / "log.mcap"
    simulate_model(tmp_path / "model.yaml", tmp_path / "motion.yaml", str(FILE), log)
    content = json.loads(run_logs([log], None, tmp_path / "out", Reading(), reversals="culled"))
    deviations = [p["sd"] for p in content["base_parameters"]]
    assert errors(trial, motion) == pytest.approx(np.mean(np.log(deviations)), abs=1e-6)


def test_the_model_becomes_the_arm_that_is_moved(
    place: DesignTask, trial: ClosedLoopTrial, motion: np.ndarray, tmp_path: Path
) -> None:
    path = tmp_path / "model.yaml"
    model_of(place).save(path)
    read = problem_of(place_of(FILE, None, path), DesignSettings()).trial
    assert read is not None
    assert errors(read, motion) == pytest.approx(errors(trial, motion), abs=1e-9)


def test_a_model_of_another_arm_is_refused(place: DesignTask, tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    model_of(place).save(path)
    path.write_text(path.read_text(encoding="utf-8").replace("wam/", "other/"), encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        place_of(FILE, None, path)
    assert "has the joints other/" in str(caught.value)


def test_only_errors_are_tried(place: DesignTask) -> None:
    assert problem_of(place, DesignSettings(objective="balanced")).trial is not None
    with pytest.raises(ConfigurationError) as caught:
        problem_of(place, DesignSettings(objective="condition"))
    assert "--objective condition does not ask for" in str(caught.value)
    assert problem_of(replace(place, known=None), DesignSettings()).trial is None


class Counted:
    """Errors that a motion's size decides, and how often they were asked for."""

    def __init__(self) -> None:
        self.asked = 0

    def errors(self, coefficients: np.ndarray) -> Iterator[float]:
        for luck in (0.5, -0.5):
            self.asked += 1
            yield -7.0 + luck + float(np.abs(coefficients).max())

    def prepare(self) -> None:
        """Nothing to compile."""


def with_count(problem: Problem, most: float = np.inf) -> tuple[Problem, Counted]:
    """The problem with counted tries, which motions beyond the bound do not get."""
    count = Counted()
    objective = replace(problem.objective, most=most)
    return replace(problem, trial=count, objective=objective), count  # pyright: ignore[reportArgumentType]


@pytest.mark.thorough
def test_a_motion_is_worth_the_mean_of_its_tries(problem: Problem, motion: np.ndarray) -> None:
    counted, count = with_count(problem)
    (found,) = Judge(counted, NEVER).of(motion, [])
    formula = candidate(counted, found.coefficients)
    assert count.asked == 2
    assert found.rest == formula.rest
    assert found.value == pytest.approx(formula.rest - 7.0 + np.abs(found.coefficients).max())


def test_a_motion_that_is_clearly_behind_is_tried_no_longer(
    problem: Problem, motion: np.ndarray
) -> None:
    counted, count = with_count(problem)
    (found,) = Judge(counted, NEVER).of(motion, [])
    better = [replace(found, tries=tuple(e - 1.0 for e in found.tries)) for _ in range(POOL)]
    assert len(Judge(counted, NEVER).of(motion, better[1:])) == 1  # few are kept
    assert count.asked == 2 + 2
    assert Judge(counted, NEVER).of(motion, better) == []
    assert count.asked == 2 + 2 + 1  # behind after one try
    others = [replace(found, rest=found.rest - 1.0) for _ in range(POOL)]
    assert Judge(counted, NEVER).of(motion, others) == []
    assert count.asked == 2 + 2 + 1  # behind even with the best errors of all


def test_after_the_deadline_nothing_is_tried(problem: Problem, motion: np.ndarray) -> None:
    counted, count = with_count(problem)
    (found,) = Judge(counted, AT_ONCE).of(motion, [])
    assert found.value == pytest.approx(UNSEEN + candidate(counted, found.coefficients).value)
    assert Judge(counted, AT_ONCE).of(motion, [found]) == []
    assert count.asked == 0


def test_where_no_arm_shows_anything_the_formula_counts(
    problem: Problem, trial: ClosedLoopTrial, motion: np.ndarray
) -> None:
    tiny = scaled(motion, 1e-3)
    (found,) = Judge(replace(problem, trial=trial), NEVER).of(tiny, [])
    formula = candidate(problem, found.coefficients)
    assert found.value == pytest.approx(UNSEEN + formula.value)


def test_a_search_yields_what_was_tried_last(
    problem: Problem, motion: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What keeps the bound of the condition number is tried out before it is yielded."""
    counted, _ = with_count(problem, most=60.0)
    monkeypatch.setattr(searching, "descend", lambda problem, first, *_: first)
    effort = Effort(NEVER, descents=6, patience=60, gain=1e-3)
    found = list(search(counted, counted.grid, effort, 0, motion))
    assert [c.value for c in found] == sorted((c.value for c in found), reverse=True)
    assert found[-1].condition_number < 60.0
    assert found[-1].value < UNSEEN


def test_without_a_motion_within_the_bound_the_condition_number_counts(
    problem: Problem, motion: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted, _ = with_count(problem, problem.objective.most)
    monkeypatch.setattr(searching, "descend", lambda problem, first, *_: first)
    effort = Effort(NEVER, descents=3, patience=60, gain=1e-3)
    found = list(search(counted, counted.grid, effort, 0, motion))
    assert found[-1].condition_number == min(c.condition_number for c in found)
