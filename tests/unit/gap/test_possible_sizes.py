"""Sizes that an effect cannot have, or not beside possible links, and torque that it spoils."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from test_certainty import SURE, beside_an_offset

from ident.gap.naming.certainty import Suspected, certainties, set_apart
from ident.gap.naming.terms_on_demand import terms_on_demand
from ident.gap.regression.current_model import extend
from ident.gap.settings import GapSettings
from ident.workflows import gap_outcome
from ident.workflows.gap_json import suspected_content
from wamctl.arm.errors import DataError

SETTINGS = GapSettings()
DRAG = ("nonlinear_viscous", (4,))
SPRING = ("joint_spring", (4,))


@pytest.mark.parametrize(("stiffness", "possible"), [(0.8, True), (-0.8, False)])
def test_a_spring_that_pushes_away_is_none(source, plain, stiffness, possible):
    source, state = beside_an_offset(source, plain, "joint_spring", stiffness=stiffness)
    state = state.with_only(state.accepted[1:])
    ((values, found),) = certainties(source, state, SETTINGS)
    assert values["stiffness"].value == pytest.approx(stiffness, rel=0.05)
    assert found.in_bounds is possible
    kept, apart = set_apart(source, state, SETTINGS)
    assert (SPRING in [a.place for a in kept.accepted]) is possible
    terms = terms_on_demand(source, kept, [replace(s, certainty=SURE) for s in apart], SETTINGS)
    assert SPRING not in [t.effect.place for t in terms]


@pytest.mark.parametrize(("share", "sure"), [(0.95, True), (0.5, False), (-0.3, False)])
def test_a_size_that_possible_links_do_not_leave_is_not_sure(
    source, plain, monkeypatch, share, sure
):
    source, state = beside_an_offset(source, plain, "joint_spring", stiffness=0.8)
    state = state.with_only(state.accepted[1:])

    def beside_links(_source, fit, _count):
        return SimpleNamespace(effects=[share * e for e in fit.effects])

    monkeypatch.setattr("ident.gap.naming.certainty.feasible_fit", beside_links)
    kept, apart = set_apart(source, state, SETTINGS)
    assert (SPRING in [a.place for a in kept.accepted]) is sure
    assert sure or "physically possible" in apart[0].doubt


@pytest.mark.parametrize(("with_it", "stays"), [(0.9, True), (1.1, False)])
def test_what_spoils_unfiltered_torque_is_not_in_the_model_without_a_name(
    nothing_hidden, source, plain, monkeypatch, with_it, stays
):
    _, state = beside_an_offset(source, plain, "nonlinear_viscous", drag=0.1)
    drag = state.accepted[1]
    end = extend(nothing_hidden.rows, nothing_hidden.start, [drag.candidate])
    unsure = Suspected(drag, {}, SURE, "too small", in_model=True)
    verdict = replace(nothing_hidden.verdict, suspected=(unsure,))
    found = replace(nothing_hidden, end=end, verdict=verdict)
    errors = []

    def predicted(model, _arm, data):
        if data.name == "short":
            raise DataError("too short")
        errors.append(with_it if model.effects.records else 1.0)
        return SimpleNamespace(raw={model.estimator: SimpleNamespace(relative_percent=errors[-1])})

    known = gap_outcome.counted(found.source)
    short = [replace(data, name="short") for data in known]
    monkeypatch.setattr(gap_outcome, "counted", lambda _: [*known, *short])
    monkeypatch.setattr(gap_outcome, "predict", predicted)
    outcome = gap_outcome.outcome_of(found, lambda _: None)
    outcome, written = gap_outcome.written_model(outcome, lambda _: None)
    assert written.failed == ()
    assert sorted(errors) == sorted([with_it, 1.0])
    assert [s.in_model for s in outcome.found.verdict.suspected] == [stays]
    assert [e.name for e in written.model.effects.records] == [DRAG[0]] * stays
    assert len(outcome.final.effects) == stays
    (told,) = suspected_content(outcome.found, outcome.final)
    sizes = {name: p["value"] for name, p in told["parameters"].items()}
    of_model = [{n: v.value for n, v in values.items()} for values in outcome.final.parameters]
    assert sizes == (of_model[0] if stays else {})
