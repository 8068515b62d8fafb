"""One model on one log has one error, told by `ident run`, `ident validate` and `ident gap`."""

from dataclasses import replace

import numpy as np
import pytest
from chain_arm import Experiment

from ident.checks.remark import Grade
from ident.effects.bound_effects import bound
from ident.effects.compensation import without_effects
from ident.effects.reversal_friction import BASIS, USUAL, shapes_of
from ident.estimation.reversal_shapes import KnownShapes
from ident.gap.results.full_model import fitted_beside
from ident.identification.validation import arm_of, predict
from ident.model.records import EffectRecord
from ident.recordings.dataset import in_memory
from ident.workflows.model_errors import (
    errors_on,
    withheld_names,
    worse_reference,
    worse_than_run,
)
from ident.workflows.run import run_data
from ident.workflows.validate import predicts
from wamctl.arm.errors import DataError

STRIBECK = EffectRecord(
    name="stribeck",
    joints=(2,),
    equation="",
    variant="",
    parameters={"extra_friction": 0.4},
    units={"extra_friction": "N m"},
    settings={"speed": 0.2, "exponent": 2.0, "slow_decay": 0.0},
    rows=(2,),
)

OFFSETS = np.array([3.0, -2.0, 1.0])
"""Of the joints [N m]."""


@pytest.fixture(scope="module")
def fitted():
    log = Experiment(joints=3, seconds=20.0).log()
    arm = log.arm()
    data = log.dataset(arm, "log")
    return arm, data, run_data(arm, [data])


def validated(model, data) -> float:
    return predict(model, arm_of(model), data).filtered[model.estimator].relative_percent


def test_of_a_fit(fitted):
    _, data, run = fitted
    (told,) = run.content["errors"]
    assert told["name"] == "log"
    assert told["relative_error_percent"] == pytest.approx(validated(run.model, data), rel=1e-6)


def test_of_a_fit_beside_effects_that_were_given(fitted):
    """The torque of the effects is formed with the parameters that were found, and counts whole."""
    arm, data, first = fitted
    known = replace(first.model, effects=bound([STRIBECK]))
    run = run_data(arm, [data], known=known)
    (told,) = run.content["errors"]
    assert told["relative_error_percent"] == pytest.approx(validated(run.model, data), rel=1e-9)
    (bare,) = errors_on(replace(run.model, effects=bound([])), [data])
    assert abs(bare["relative_error_percent"] - told["relative_error_percent"]) > 0.1


def test_effects_beside_which_the_arm_explains_less_are_seen(fitted):
    _, data, run = fitted
    wrong = STRIBECK.model_copy(update={"parameters": {"extra_friction": 4.0}})
    model = replace(run.model, effects=bound([wrong]))
    ((much,), (little,)) = worse_than_run(errors_on(model, [data]), run.model, [data])
    assert little == pytest.approx(run.content["errors"][0]["relative_error_percent"])
    assert much > 2 * little
    assert worse_than_run(errors_on(run.model, [data]), run.model, [data]) is None
    (of_reference, of_search) = (
        say(([much], [little])) for say in (worse_reference, withheld_names)
    )
    for remark in (of_reference, of_search):
        assert remark.grade is Grade.DOUBTFUL
        assert f"{much:.3g} instead of {little:.3g} %" in remark.finding


def test_a_recording_too_short_for_effects_does_not_cost_the_result(fitted):
    _, data, run = fitted
    model = replace(run.model, effects=bound([STRIBECK]))
    whole = data.segments[0]

    def first(samples):
        few = replace(whole, q=whole.q[:samples], tau=whole.tau[:samples], reference=None)
        return in_memory(replace(data, name="short"), data.rate_hz, [replace(few, used=None)])

    assert data.rate_hz == 100.0
    assert 0.0 < validated(model, first(230)) < 20.0
    short = first(70)
    with pytest.raises(DataError, match="short"):
        validated(model, short)
    assert [e["name"] for e in errors_on(model, [short, data])] == ["log"]


@pytest.fixture(scope="module")
def shifted(fitted):
    """The same log with offsets."""
    _, data, _ = fitted
    whole = data.segments[0]
    return in_memory(data, data.rate_hz, [replace(whole, tau=whole.tau + OFFSETS)])


def test_the_gaps_model_is_what_a_run_fits_beside_its_effects(fitted):
    arm, data, first = fitted
    known = replace(first.model, effects=bound([STRIBECK]))
    model, _ = fitted_beside(known, (), [data], arm)
    assert np.array_equal(model.delta, run_data(arm, [data], known=known).model.delta)
    assert model.effects.records == known.effects.records


def test_without_effects_the_gaps_model_is_that_of_a_run_alone(fitted):
    arm, data, first = fitted
    model, _ = fitted_beside(replace(first.model, effects=bound([])), (), [data], arm)
    assert np.array_equal(model.delta, first.model.delta)
    assert model.filter.cutoff_hz == first.model.filter.cutoff_hz


def test_two_effects_of_one_kind_at_one_joint_stay_two(fitted):
    arm, data, first = fitted
    known = replace(first.model, effects=bound([STRIBECK, STRIBECK]))
    model, _ = fitted_beside(known, (), [data], arm)
    assert model.effects.records == known.effects.records


@pytest.mark.parametrize(("term", "kept"), [("auto", [2]), ("coulomb", [1, 2])])
def test_offsets_are_of_the_size_of_a_term_where_the_settings_may_hold_one(
    fitted, shifted, term, kept
):
    arm, _, first = fitted
    known = replace(
        first.model,
        effects=bound([of_joint(j, "torque_offset", offset=x) for j, x in ((1, 2.0), (2, -2.0))]),
    )
    arm = arm.with_settings(terms=("viscous", "coulomb", term))
    model, _ = fitted_beside(known, {("torque_offset", (1,))}, [shifted], arm)
    assert [e.joints[0] for e in model.effects.records] == kept
    if term == "auto":
        (named,) = model.effects.records
        fo = model.parameter("fo") + np.array([0.0, named.parameters["offset"], 0.0])
        assert fo == pytest.approx(OFFSETS, abs=0.1)
        assert abs(model.parameter("fo")[1]) < 1e-2


def of_joint(joint: int, name: str, **parameters: float) -> EffectRecord:
    return EffectRecord(
        name=name,
        joints=(joint,),
        equation="",
        variant="",
        parameters=parameters,
        units={},
        settings={},
        rows=(joint,),
    )


def test_a_rotor_among_the_effects_has_the_errors_of_one_among_the_terms(fitted):
    """Unfiltered torque is compared with the rotor's along the links' motion, not a noisier one."""
    arm, data, _ = fitted
    whole = data.segments[0]
    q = whole.q + 2e-4 * np.random.default_rng(0).normal(size=whole.q.shape)
    noisy = in_memory(data, data.rate_hz, [replace(whole, q=q)])
    arm = arm.with_settings(terms=("viscous", "coulomb", "rotor_inertia"), cutoff_hz=4.0)
    model = replace(run_data(arm, [noisy]).model, base_parameters=())
    place = [p.name for p in model.parameters].index("ia2")
    term, bare = model.delta.copy(), model.delta.copy()
    term[place], bare[place] = 0.5, 0.0
    effect = replace(model, delta=bare, effects=bound([of_joint(2, "rotor_inertia", inertia=0.5)]))
    errors = [
        [side[model.estimator].relative_percent for side in (p.filtered, p.raw)]
        for m in (replace(model, delta=term), effect)
        for p in [predict(m, arm_of(m), noisy)]
    ]
    assert errors[0] == pytest.approx(errors[1], rel=0.03)


def test_effects_turn_round_as_the_model_says(fitted):
    """A wide curve and a narrow one give another torque of the same effect at reversals."""
    _, data, run = fitted
    n = run.model.robot.dof
    torques = []
    for place in (0, 9):  # ramps of the least and of the largest width
        shapes = np.tile(np.eye(len(BASIS))[place], (n, 1))
        fit = replace(run.model.filter, reversals=KnownShapes(BASIS, shapes).for_model())
        assert np.array_equal(shapes_of(fit.reversals, n), shapes)
        model = replace(run.model, filter=fit, effects=bound([STRIBECK]))
        torques.append(without_effects(model, data).segments[0].tau[:, 1])
    assert np.abs(torques[0] - torques[1]).max() > 0.1 * 0.4


def test_without_curves_friction_turns_round_as_usual():
    assert np.array_equal(shapes_of((), 2), np.array([USUAL, USUAL]))


def test_a_model_that_predicts_takes_back_what_its_links_say(fitted):
    """Only a model that holds effects and predicts the recording may say so."""
    _, data, run = fitted
    model = run.model
    arm = arm_of(model)
    known = replace(model, effects=bound([of_joint(2, "torque_offset", offset=0.0)]))
    assert predicts(known, arm, [data], [data])
    assert not predicts(model, arm, [data], [data])
    whole = data.segments[0]
    noise = np.random.default_rng(1).normal(size=whole.tau.shape)
    wrong = in_memory(data, data.rate_hz, [replace(whole, tau=noise)])
    assert not predicts(known, arm, [wrong], [wrong])
