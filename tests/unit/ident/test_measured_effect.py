"""An effect outside the catalogue as a measured curve."""

import numpy as np
import pytest
from test_model_with_effects import error, named, plain, record, run_of

from ident.effects.measured_effect import EFFECT, KNOTS, VARIANTS, curve_over

ENDS = {"position": (-1.0, 1.0), "speed": (0.0, 1.0), "time": (0.0, 6.0)}


@pytest.fixture(scope="module")
def floor() -> np.ndarray:
    return error(plain(), run_of(plain()))


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_simulated_arm_and_the_prediction_have_the_same_curve(variant, floor):
    free = len(curve_over(variant, 1, ENDS).coefficients)
    first = KNOTS - free if variant in ("position", "speed", "time") else 1
    values = {f"at_{k + 1}": 1.0 + np.cos(1.3 * k) for k in range(first, first + free)}
    low, high = ENDS[variant.split()[0]]
    model = named(record(EFFECT.id, (2,), values, {"low": low, "high": high}, variant))
    recording = run_of(model)
    without, with_it = error(plain(), recording), error(model, recording)
    assert np.linalg.norm(with_it - floor) < 0.25 * np.linalg.norm(without - floor)
