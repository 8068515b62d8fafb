"""Which effects are named where torque drives the arm, and which are only suspected."""

import numpy as np
import pytest
from driven_arm import COULOMB, URDF, VISCOUS, friction_of, recording

import ident
from ident.identification.by_simulation import by_simulation
from ident.output_error.driven.fit import fitted
from ident.output_error.driven.search import (
    DrivenSearch,
    Step,
    Tried,
    block_errors,
    block_groups,
    turning,
)
from ident.output_error.driven.starts import starts_of
from ident.output_error.driven.verdict import beats_stiff_gears, closes_a_gap
from ident.output_error.search.settings import SearchSettings
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.workflows.run import run_data

FLOOR, STEP = np.array([3e-5, 3e-5]), np.array([1e-4, 1e-4])


@pytest.mark.parametrize(
    ("before", "after", "closes"),
    [(4e-4, 5e-5, True), (4.5e-5, 3e-5, False), (9e-5, 3e-5, False), (4e-4, 3.95e-4, False)],
    ids=["a gap", "within noise", "less than a step", "a gap that stays"],
)
def test_an_effect_has_to_close_a_gap(before: float, after: float, closes: bool) -> None:
    at_rest = np.full((10, 1), FLOOR[0])
    errors = [np.hstack([at_rest, np.full((10, 1), x)]) ** 2 for x in (before, after)]
    assert closes_a_gap(*errors, FLOOR, STEP, SearchSettings()) is closes


@pytest.mark.parametrize(("stiffness", "beats"), [(60.0, True), (None, False)])
def test_gears_that_give_have_to_beat_stiff_ones(tmp_path, stiffness, beats) -> None:
    urdf = tmp_path / "two.urdf"
    urdf.write_text(URDF)
    log = recording(8.0, 0, stiffness, friction_of(VISCOUS, COULOMB, 1e-2)).log
    arm = ident.Arm.from_urdf(urdf).of_recording(log.joint_names)
    run = run_data(arm, [dataset_for(arm, summarise_log(log, "log"))])
    made, moving = by_simulation(run.found), np.array([True, True])
    settings, further = turning(made.fit.settings, moving)
    base = fitted(made.arm, made.fit.beta, settings, further)
    starts = starts_of(made.arm, base, moving)
    start = [s for s in starts if s.kind.name == "joint_elasticity" and s.joint == 1][4]
    fit = fitted(made.arm, base.beta, start.settings, [*further, *start.further])
    groups = block_groups(made.arm)
    errors = [block_errors(made.arm, x, groups) for x in (base, fit)]
    found = DrivenSearch(base, errors[0], (Step(Tried(start, fit, errors[1], 1.0, 9.0), ()),))
    assert beats_stiff_gears(made.arm, found, start, SearchSettings()) is beats
