"""A mass at the tool, beside a model that was made without it."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import estimates_of, recorded, source_of, wam

from ident.checks.examine import OF_LOADS, examine
from ident.effects.bound_effects import BoundEffects
from ident.effects.catalogue import catalogue
from ident.effects.simulated_model import with_loads
from ident.gap.data.experiment import facts_of
from ident.gap.options import Options
from ident.gap.regression.current_model import extend, nominal_fit
from ident.gap.search import rows_of, search
from ident.gap.selection.estimates import final_estimates
from ident.gap.settings import Significance
from ident.identification.identify import identify, model_of
from ident.simulation.arm import SimulatedArm

MASS = 2.0  # kg
CENTRE = (0.1, -0.1, 0.2)  # m, from the last link's frame
ROD = 0.3  # m, along x
NAMES = ("mass", "first_moment_x", "first_moment_y", "first_moment_z")


def inertias(rod: float) -> np.ndarray:
    """Tensor of the load, a rod of this length, in the last link's frame [kg m^2], shape (6,)."""
    x, y, z = CENTRE
    own = rod**2 / 12
    point = [y * y + z * z, -x * y, -x * z, x * x + z * z + own, -y * z, x * x + y * y + own]
    return MASS * np.array(point)


def loaded(rod: float) -> SimulatedArm:
    """The arm with the load."""
    arm = wam()
    delta = arm.delta.copy()
    delta[-10:] += [*inertias(rod), *(MASS * np.array(CENTRE)), MASS]
    return replace(arm, delta=delta)


@pytest.mark.parametrize("rod", [0.0, pytest.param(ROD, marks=pytest.mark.thorough)])
def test_a_load_at_the_tool_is_a_payload_and_nothing_else(source, rod):
    """Away from the axes, its tensor is as much of what the wrist feels as its weight is.

    That of a rod, beside a point mass, was taken for rotors of the wrist.
    """
    known = model_of(identify(source.datasets, source.arm))
    after = replace(source_of(recorded(loaded(rod), 1)), reference_model=known)
    found = search(after, Options(null_runs=1), lambda _: None)
    assert [f.candidate.effect for f in found.verdict.effects] == ["payload"]
    values = estimates_of(found)[0]
    sizes = [values[name].value for name in NAMES]
    assert sizes == pytest.approx(MASS * np.array([1.0, *CENTRE]), rel=0.005)


def test_the_tensor_of_a_body_does_not_go_into_its_first_moment(source):
    """As a point mass, a rod's first moment came out up to 0.004 kg m off, three deviations."""
    known = model_of(identify(source.datasets, source.arm))
    after = replace(source_of(recorded(loaded(ROD), 1)), reference_model=known)
    rows, facts = rows_of(after, Options()), facts_of(after)
    payload = catalogue()["payload"]
    body = [payload.final_form(h) for h in payload.candidates(facts)]
    end = extend(rows, nominal_fit(rows, facts), body)
    (values,) = final_estimates(rows, end, Significance(), systematic=True).parameters
    true = np.array([MASS, *(MASS * np.array(CENTRE)), *inertias(ROD)])
    errors = np.array([v.value for v in values.values()]) - true
    sds = np.array([v.sd for v in values.values()])
    assert (np.abs(errors) < 3.0 * sds).all()
    assert (sds < 4e-4).all()


def test_a_load_that_the_model_knows_is_nothing_that_the_urdf_lacks(source):
    """A model with a payload was told of its own recordings that they look like currents."""
    known = model_of(identify(source.datasets, source.arm))
    payload = catalogue()["payload"]
    body = payload.final_form(*payload.candidates(facts_of(source)))
    values = np.array([0.6, 0.0, 0.0, 0.048, 4e-3, 0.0, 0.0, 4e-3, 0.0, 3e-4])
    data = source_of(recorded(payload.simulated(wam(), body, values), 1)).datasets
    model = replace(known, effects=BoundEffects(((body, values),)))
    told = [
        {r.code for r in examine(arm, data).remarks} & set(OF_LOADS)
        for arm in (with_loads(source.arm, known), with_loads(source.arm, model))
    ]
    assert told == [{"current_not_torque"}, set()]


def test_a_body_is_simulated_as_the_nearest_one_that_can_exist(source):
    effect, arm = catalogue()["payload"], wam()
    (point,) = effect.candidates(facts_of(source))
    body = effect.final_form(point)
    rod = np.array([MASS, *(MASS * np.array(CENTRE)), *inertias(ROD)])
    np.testing.assert_allclose(effect.simulated(arm, body, rod).delta, loaded(ROD).delta)
    less = np.concatenate([rod[:4], 0.9 * inertias(0.0)])  # less than as a point
    np.testing.assert_allclose(effect.simulated(arm, body, less).delta, loaded(0.0).delta)


def test_a_payload_of_no_mass_has_no_centre(source):
    effect = catalogue()["payload"]
    (hypothesis,) = effect.candidates(facts_of(source))
    assert not effect.linear_in_coefficients
    assert effect.linearised_at(hypothesis, np.array([0.0, 0.1, 0.0, 0.0])) == hypothesis
    turned = effect.linearised_at(hypothesis, np.array([2.0, 0.1, 0.0, -0.4]))
    assert turned.numbers == {"about_x": 0.05, "about_y": 0.0, "about_z": -0.2}
