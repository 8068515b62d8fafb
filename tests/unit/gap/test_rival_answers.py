"""Rival answers of an investigation: fitted alike, and arms that follow what was followed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.dynamics.regressor import Motion
from ident.effects.bound_effects import bound
from ident.effects.catalogue import catalogue
from ident.gap.nulls.null_arms import reference_motion
from ident.gap.options import Options
from ident.planning.choice import that_followed
from ident.planning.hypotheses import NONE, Answer, Hypothesis, hypotheses, in_its_place
from ident.workflows.design import place_of


@pytest.fixture(scope="module")
def answers(source):
    offset = catalogue()["torque_offset"].at((3,))
    answer = Answer({"verdict": "named", "effects": [], "suspected": []}, (offset,))
    return {h.name: h for h in hypotheses(source, answer, Options(), lambda _: None)}


def test_no_effect_is_fitted_to_as_much_data_as_an_effect(answers):
    nothing, extra = (np.diag(answers[name].known.products) for name in (NONE, "torque_offset:4"))
    assert len(extra) == len(nothing) + 1
    np.testing.assert_allclose(nothing, extra[: len(nothing)], rtol=0.1)


def test_a_rival_under_which_the_arm_would_not_have_followed_its_motion_is_none(source, answers):
    leader, plain = answers["torque_offset:4"], answers[NONE]
    heavy = replace(plain, name="heavy", model=replace(plain.model, delta=20 * plain.model.delta))
    ran = Motion(*reference_motion(source, source.recordings[0])[0])
    place = place_of(Path("wam7.yaml"), "all")
    assert that_followed(place, [leader, heavy, plain], ran) == [leader, plain]


def test_what_acts_at_other_joints_is_true_beside_an_effect_and_not_in_its_place(answers):
    leader, plain = answers["torque_offset:4"], answers[NONE]

    def acting(name: str, *joints: int) -> Hypothesis:
        (record,) = leader.model.effects.records
        effects = bound([record.model_copy(update={"joints": joints, "rows": joints})])
        return replace(leader, name=name, model=replace(leader.model, effects=effects))

    same, all_joints, wrist = acting("same", 4), acting("all", *range(1, 8)), acting("wrist", 5)
    partner = acting("partner", 6)  # joints 5 and 6 share their motors
    assert in_its_place([leader, plain, same, all_joints, wrist]) == [
        leader,
        plain,
        same,
        all_joints,
    ]
    assert in_its_place([wrist, plain, partner, leader]) == [wrist, plain, partner]
    assert in_its_place([plain, leader, wrist]) == [plain, leader, wrist]
