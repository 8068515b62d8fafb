"""An effect outside the catalogue as a measured curve."""

import numpy as np
import pytest
from test_model_with_effects import error, named, plain, record, run_of

from ident.effects.measured_effect import ACROSS, EFFECT, KNOTS, PERIODIC, VARIANTS, curve_over

ENDS = {
    "position": (-1.0, 1.0),
    "speed": (0.0, 1.0),
    "time": (0.0, 6.0),
    "angle": (-1.0, -0.5),
    "other position": (-1.0, 1.0),
    "other velocity": (-1.0, 1.0),
}


@pytest.fixture(scope="module")
def floor() -> np.ndarray:
    return error(plain(), run_of(plain()))


def variable(variant: str) -> str:
    return max((name for name in ENDS if variant.startswith(name)), key=len)


@pytest.mark.parametrize("variant", [*VARIANTS, PERIODIC, *ACROSS])
def test_the_simulated_arm_and_the_prediction_have_the_same_curve(variant, floor):
    ends = ENDS[variable(variant)]
    joints = (1, 3) if variant in ACROSS else (1,)
    curve = curve_over(variant, joints, ends)
    values = {c.name: 1.0 + np.cos(1.3 * int(c.name[3:])) for c in curve.coefficients}
    settings = {"low": ends[0], "high": ends[1]}
    model = named(record(EFFECT.id, [j + 1 for j in joints], values, settings, variant, (2,)))
    recording = run_of(model)
    without, with_it = error(plain(), recording), error(model, recording)
    assert np.linalg.norm(with_it - floor) < 0.25 * np.linalg.norm(without - floor)


def test_what_friction_has_already_is_left_out_of_a_curve_and_a_period_has_no_end():
    free = {v: len(curve_over(v, (0,), (0.0, 1.0)).coefficients) for v in (*VARIANTS, PERIODIC)}
    whole = ("position", "speed", "time")
    assert {free[v] for v in whole} == {KNOTS}
    assert free["speed direction"] == KNOTS - 2
    assert {free[v] for v in ("position velocity", "time direction", PERIODIC)} == {KNOTS - 1}
