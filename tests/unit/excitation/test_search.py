"""The searches: when they stop, what they go on from, and that what they yield keeps its limits."""

import multiprocessing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.excitation.design import DesignTask, design, problem_of
from ident.excitation.optimisation import search as searching
from ident.excitation.optimisation.deadline import Deadline
from ident.excitation.optimisation.evaluate import Candidate
from ident.excitation.optimisation.multistart import Task, best_design
from ident.excitation.optimisation.search import Effort, random_start, search
from ident.excitation.problem.design_problem import Problem, constraint_values, objective_value
from ident.excitation.problem.trajectory_grid import grid
from ident.excitation.settings import GOOD_CONDITION, DesignSettings
from ident.workflows.design import place_of

FUNDAMENTAL = 0.1 * np.pi
DENSE = grid(FUNDAMENTAL, 5, 1000)
SHARP = 1e-12


NEVER, AT_ONCE = Deadline(np.inf), Deadline(0.0)


def effort(deadline: Deadline = NEVER, descents: int = 3, patience: int = 60) -> Effort:
    return Effort(deadline, descents, patience, gain=1e-3)


@pytest.fixture(scope="module")
def motion_problem() -> Problem:
    """Only the joints' own limits, which cost least to evaluate."""
    place = place_of(Path("excitation-published-limits.yaml"))
    return problem_of(place, DesignSettings(objective="condition"))


@pytest.fixture
def start(motion_problem: Problem, rng: np.random.Generator) -> np.ndarray:
    return random_start(motion_problem, rng)


def kept(problem: Problem, candidate: Candidate) -> bool:
    judged = replace(problem, grid=DENSE)
    return constraint_values(judged, candidate.coefficients, SHARP).max() <= 1.0


def test_every_yield_is_better_and_within_the_limits(motion_problem: Problem) -> None:
    found = list(search(motion_problem, DENSE, effort(), 1, None))
    values = [c.value for c in found]
    assert len(found) >= 2
    assert values == sorted(values, reverse=True)
    assert all(kept(motion_problem, c) for c in found)
    assert np.exp(values[-1]) < 50.0


@pytest.mark.thorough
def test_the_same_seed_finds_the_same(motion_problem: Problem) -> None:
    first, second = (list(search(motion_problem, DENSE, effort(), 4, None)) for _ in range(2))
    assert [c.value for c in first] == [c.value for c in second]


@pytest.fixture
def descents(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Starts of all descents, none of which gets anywhere."""
    made: list[np.ndarray] = []

    def stay(problem: Problem, first: np.ndarray, *_: object) -> np.ndarray:
        made.append(first)
        return first

    monkeypatch.setattr(searching, "descend", stay)
    return made


def test_it_stops_when_the_time_is_over(
    motion_problem: Problem, descents: list[np.ndarray], start: np.ndarray
) -> None:
    over = effort(AT_ONCE, descents=1000)
    found = list(search(motion_problem, DENSE, over, 0, start))
    assert len(found) == 1
    assert found[0].coefficients == pytest.approx(start, abs=1e-2)
    assert len(descents) == 1  # the polish, which looks at the clock itself


def test_it_stops_when_nothing_is_gained(
    motion_problem: Problem, descents: list[np.ndarray], start: np.ndarray
) -> None:
    patient = replace(effort(descents=1000, patience=5), gain=100.0)
    list(search(motion_problem, DENSE, patient, 0, start))
    assert len(descents) == 5 + 1


def test_it_goes_on_from_a_start(
    motion_problem: Problem, descents: list[np.ndarray], start: np.ndarray
) -> None:
    found = list(search(motion_problem, DENSE, effort(descents=4), 0, start))
    assert (descents[0] == start).all()
    judged = objective_value(motion_problem, start, DENSE)
    assert found[0].value == pytest.approx(judged, abs=1e-2)
    assert (descents[-1] == found[-1].coefficients).all()  # the polish, of the best


def test_workers_hand_over_the_best(motion_problem: Problem) -> None:
    reports: list[Candidate | None] = []
    task = Task(motion_problem, DENSE, effort(descents=1), 0, None)
    before = set(multiprocessing.active_children())
    best = best_design(task, 2, reports.append)
    better = [r for r in reports if r is not None]
    assert best is not None
    assert best is better[-1]
    assert best.value == min(c.value for c in better)
    assert set(multiprocessing.active_children()) <= before


def test_a_worker_that_dies_is_told(motion_problem: Problem) -> None:
    broken = replace(motion_problem, objective=None)
    task = Task(broken, DENSE, effort(descents=1), 0, None)
    with pytest.raises(RuntimeError) as caught:
        best_design(task, 1, lambda best: None)
    assert str(caught.value) == "a search process died; see its message above"


def test_where_no_start_is_allowed_a_pose_is_kept_to(place: DesignTask) -> None:
    """Clearance that few poses keep: the search is over before it meets one."""
    limits = place.limits.model_copy(update={"clearance_m": 0.16})
    tight = replace(place, limits=limits)
    settings = DesignSettings(time_s=1e-9, processes=1)
    found = design(tight, settings, None, lambda best: None)
    assert found.trajectory.promise["smallest_distance_m"] >= 0.16
    assert found.passed == []


def test_without_an_objective_errors_are_small_at_a_good_condition_number(
    place: DesignTask,
) -> None:
    usual = problem_of(place, DesignSettings()).objective
    assert (usual.kind, usual.most) == ("errors", GOOD_CONDITION)
    assert 35.0 < GOOD_CONDITION < 36.0
    other = problem_of(place, DesignSettings(most_condition=50.0)).objective
    assert (other.kind, other.most) == ("errors", 50.0)
    papers = problem_of(place, DesignSettings(objective="condition")).objective
    assert (papers.kind, papers.most) == ("condition", np.inf)
