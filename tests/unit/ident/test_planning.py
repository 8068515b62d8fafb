"""Rival answers of an investigation, and how their predictions are weighed."""

import json

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.planning.choice import expected_growth
from ident.planning.hypotheses import NONE, name_of, read_answer
from ident.workflows.plan import weigh_logs
from wamctl.arm.errors import DataError


def test_answers_are_called_by_effects_and_joints():
    spring, extra = catalogue()["joint_spring"].at((2,)), catalogue()["torque_offset"].at((0,))
    assert name_of([]) == NONE
    assert name_of([extra, spring]) == name_of([spring, extra]) == "joint_spring:3+torque_offset:1"


def test_a_block_that_other_numbers_make_up_for_tells_nothing_however_large_it_is():
    assert expected_growth(np.array([-1e5, 0.0])) == 0.0
    assert 0.0 < expected_growth(np.array([1e5, -1e5])) <= np.log(2.0)


def test_a_folder_without_a_gap_is_told(tmp_path):
    with pytest.raises(DataError, match=r"gap\.json is not a gap\.json that can be read"):
        read_answer(tmp_path)


def test_a_model_that_was_changed_after_the_plan_is_no_prediction(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "0.yaml").write_text("another model")
    models = {"none": {"file": "models/0.yaml", "sha256": "0" * 64}}
    noise = {"sigma_nm": [], "slow_rad_s": [], "cutoff_hz": 10.0, "motor_from_joint": None}
    (tmp_path / "plan.json").write_text(json.dumps({"models": models, "noise": noise}))
    with pytest.raises(DataError, match="has changed since the plan was made"):
        weigh_logs([], tmp_path, lambda _: None)
