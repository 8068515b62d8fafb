"""Rival answers of an investigation: fitted alike, and arms that follow what was followed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.dynamics.regressor import Motion
from ident.effects.catalogue import catalogue
from ident.gap.nulls.null_arms import reference_motion
from ident.gap.options import Options
from ident.planning.choice import that_followed
from ident.planning.hypotheses import NONE, Answer, hypotheses
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
