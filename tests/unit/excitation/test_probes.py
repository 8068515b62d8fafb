"""Short motions of `ident plan`: within all limits, and nobody rests."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.excitation.design import problem_of
from ident.excitation.effect_motions import PERIOD_S, PROBES, scattered
from ident.excitation.problem.design_problem import constraint_values
from ident.excitation.problem.trajectory_grid import grid, series_of
from ident.excitation.settings import DesignSettings
from ident.excitation.target_effect import frame_of
from ident.planning.choice import SLOWER, slowed, within_limits
from ident.workflows.design import place_of
from wamctl.arm.trajectory import sample

ALL = [*PROBES, "scattered"]


@pytest.fixture(scope="module")
def place():
    return place_of(Path("wam7.yaml"), "all")


@pytest.fixture(scope="module")
def frame(place):
    return frame_of(place, 4)


@pytest.mark.parametrize("name", ALL)
def test_a_probe_keeps_every_limit_and_moves_every_joint(place, frame, name):
    sketch = scattered(frame, 1) if name == "scattered" else PROBES[name](frame)
    problem = problem_of(place, DesignSettings())
    found = within_limits(problem, sketch)
    assert found is not None
    dense = grid(2 * np.pi / PERIOD_S, len(found.coefficients) // 2, 700)
    assert constraint_values(replace(problem, grid=dense), found.coefficients, 1e-12).max() < 1.02
    assert (np.ptp(dense.position @ found.coefficients, axis=0) > 0.02).all()


def test_the_first_run_has_the_same_path_at_a_quarter_of_the_speed(place, frame):
    sketch = PROBES["brisk"](frame)
    series = series_of(sketch.coefficients, place.robot.joint_names, 2 * np.pi / PERIOD_S)
    t = np.linspace(0.0, PERIOD_S, 50)
    fast, slow = sample(series, t), sample(slowed(series), SLOWER * t)
    assert slow[0] == pytest.approx(fast[0])
    assert SLOWER * slow[1] == pytest.approx(fast[1])
