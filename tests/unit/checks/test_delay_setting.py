"""A delay that the arm's settings give holds for its model, too, and for what is searched."""

import numpy as np
import pytest
from wrong_inputs import late

from ident.gap.data.experiment import of_arm
from ident.gap.options import Options
from ident.identification.validation import arm_of, predict
from ident.recordings.torque_timing import with_torque_later
from ident.workflows.gap import gap_of
from ident.workflows.run import run_data


@pytest.fixture(scope="module")
def logs():
    """Two recordings whose torque was stamped two samples late, and how late that is [s]."""
    found = [late(2, joints=3, seconds=s, seed=7) for s in (30.0, 20.0)]
    return found, 2 * float(np.median(np.diff(found[0].t)))


def test_the_model_knows_it(logs):
    (fitted, judged), seconds = logs
    arm = fitted.arm().with_settings(delay_s=-seconds)
    model = run_data(arm, [fitted.dataset(arm)]).model
    assert model.filter.delay_s == -seconds
    assert arm_of(model).settings.delay_s == -seconds
    known, unknown = arm_of(model), arm_of(model).with_settings(delay_s=0.0)
    errors = [
        predict(model, a, judged.dataset(a)).filtered["feasible"].relative_percent
        for a in (known, unknown)
    ]
    assert errors[0] < 0.2 * errors[1]


def test_a_search_is_made_on_time(logs):
    (fitted, _), seconds = logs

    def searched(arm):
        source = of_arm(arm, None, [fitted.recording()], ["log"])
        return gap_of(source, Options(null_runs=0), lambda *_: 0)

    plain = searched(fitted.arm())
    known = searched(fitted.arm().with_settings(delay_s=-seconds))
    assert [e["name"] for e in plain.content["effects"]] == ["torque_delay"]
    assert [e["name"] for e in known.content["effects"]] == []
    assert known.model.filter.delay_s == -seconds
    errors = [found.content["errors"][0]["relative_error_percent"] for found in (plain, known)]
    arm = arm_of(known.model)
    again = predict(known.model, arm, fitted.dataset(arm)).filtered["feasible"].relative_percent
    assert again == pytest.approx(errors[1], rel=0.05)


def test_effects_that_are_taken_off_act_on_time(logs):
    (fitted, _), seconds = logs
    arm = fitted.arm().with_settings(delay_s=-seconds)
    plain = run_data(arm, [fitted.dataset(arm)])
    beside = run_data(arm, [fitted.dataset(arm)], known=plain.model)
    assert beside.model.filter.delay_s == -seconds
    errors = [r.content["errors"][0]["relative_error_percent"] for r in (plain, beside)]
    assert errors[1] == pytest.approx(errors[0], rel=0.05)


def test_torque_is_moved_by_parts_of_a_sample(logs):
    (log, _), _ = logs
    data = log.dataset(log.arm())
    there = with_torque_later(with_torque_later(data, 0.0123), -0.0123)
    before, after = data.segments[0].tau, there.segments[0].tau
    inside = slice(200, -200)
    assert np.abs(after - before)[inside].max() < 1e-3 * np.abs(before).max()
