"""The four published trajectories: their condition numbers, and that an arm may run them."""

from pathlib import Path

import numpy as np
import pytest

from ident.dynamics.regressor import Motion
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.regressor_columns import exact_rows
from ident.workflows.design import place_of
from wamctl.arm.trajectory import FourierSeries, Trajectory, sample
from wamctl.arm.trajectory_check import check_trajectory

pytestmark = pytest.mark.data

FUNDAMENTAL = 0.1 * np.pi
PUBLISHED = {57: (54.9, 55.8, 47.9, 62.3), 69: (97.9, 98.1, 112.2, 105.2)}
LENGTHS_S = (60.958, 60.968, 60.932, 60.950)
"""Of the study's reference files."""

UNSEEN_FROM_S = 15.0
"""Where the stretch that the trimmed files miss once begins in the published period."""


def published(folder: Path, number: int) -> FourierSeries:
    path = folder / "wam7_reference" / f"traj{number}_one_period_500Hz.csv"
    spectrum = np.fft.rfft(np.loadtxt(path, delimiter=",", skiprows=1), axis=0) / 10_000
    omega = FUNDAMENTAL * np.arange(1, 6)[:, None]
    a, b = -2 * spectrum[1:6].imag * omega, -2 * spectrum[1:6].real * omega
    names = place_of(Path("excitation-published-limits.yaml")).robot.joint_names
    return FourierSeries(names, FUNDAMENTAL, a.T, b.T, spectrum[0].real)


@pytest.mark.parametrize("count", [57, 69])
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_condition_numbers(
    problem: Problem, full_problem: Problem, real_data: Path, number: int, count: int
) -> None:
    """The data's README counts the study's files less 3 s at the start and 1 s at the end."""
    columns = (problem if count == 57 else full_problem).columns
    step = 0.01
    motion = Motion(*sample(published(real_data, number), np.arange(0.0, 20.0, step)))
    rows = exact_rows(columns, motion).reshape(2000, -1, count)
    missing = round((60.0 - (LENGTHS_S[number - 1] - 4.0)) / step)
    first = round(UNSEEN_FROM_S / step)
    seen = np.full(2000, 3.0)
    seen[first : first + missing] = 2.0
    weighted = rows * np.sqrt(seen)[:, None, None]
    condition = np.linalg.cond(weighted.reshape(-1, count))
    assert condition == pytest.approx(PUBLISHED[count][number - 1], abs=0.15)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_they_may_run_under_their_own_limits(real_data: Path, number: int) -> None:
    place = place_of(Path("excitation-published-limits.yaml"))
    trajectory = Trajectory(published(real_data, number), 3, {}, {})
    assert check_trajectory(place.arm, place.robot, trajectory) == []
