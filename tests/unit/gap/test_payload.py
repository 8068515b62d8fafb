"""A mass at the tool, beside a model that was made without it."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import estimates_of, recorded, source_of, wam

from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import facts_of
from ident.gap.options import Options
from ident.gap.search import search
from ident.identification.identify import identify, model_of

MASS = 2.0  # kg
CENTRE = (0.1, -0.1, 0.2)  # m, from the last link's frame


def test_a_ball_at_the_tool_is_a_payload_and_nothing_else(source):
    """Away from the axes, its tensor is as much of what the wrist feels as its weight is."""
    known = model_of(identify(source.datasets, source.arm))
    x, y, z = CENTRE
    tensor = [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y]
    arm = wam()
    delta = arm.delta.copy()
    delta[-10:] += MASS * np.array([*tensor, *CENTRE, 1.0])
    after = replace(source_of(recorded(replace(arm, delta=delta), 1)), reference_model=known)
    found = search(after, Options(null_runs=1), lambda _: None)
    assert [f.candidate.effect for f in found.verdict.effects] == ["payload"]
    values = estimates_of(found)[0]
    names = ("mass", "first_moment_x", "first_moment_y", "first_moment_z")
    sizes = [values[name].value for name in names]
    assert sizes == pytest.approx([MASS, MASS * x, MASS * y, MASS * z], rel=0.005)


def test_a_payload_of_no_mass_has_no_centre(source):
    effect = catalogue()["payload"]
    (hypothesis,) = effect.candidates(facts_of(source))
    assert not effect.linear_in_coefficients
    assert effect.linearised_at(hypothesis, np.array([0.0, 0.1, 0.0, 0.0])) == hypothesis
    turned = effect.linearised_at(hypothesis, np.array([2.0, 0.1, 0.0, -0.4]))
    assert turned.numbers == {"about_x": 0.05, "about_y": 0.0, "about_z": -0.2}
