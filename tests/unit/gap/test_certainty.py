"""What an effect needs to be named: to be surely not zero, to have a size, to carry over."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from closed_loop import nominal_of, source_of
from test_verdict import found, score_of

from ident.effects.candidate import Value
from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import blocks_of
from ident.gap.data.experiment import base_columns, experiment, facts_of
from ident.gap.data.windows import windows_for
from ident.gap.naming.across_recordings import (
    Across,
    across_recordings,
    relative_spread,
    with_spread,
)
from ident.gap.naming.certainty import (
    Certainty,
    Suspected,
    certainties,
    deviations,
    not_among,
    set_apart,
    sure_in_the_end,
)
from ident.gap.naming.dependence import dependences
from ident.gap.naming.terms_on_demand import terms_on_demand
from ident.gap.regression.current_model import extend, nominal_fit
from ident.gap.regression.rows import windowed_rows
from ident.gap.regression.weighted_fit import Fit
from ident.gap.results.verdict import Kind, decide
from ident.gap.selection.estimates import final_estimates
from ident.gap.selection.gauss_newton import refit
from ident.gap.selection.rivals import yields_to_constant
from ident.gap.selection.scoring import Score
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.gap.settings import GapSettings

SETTINGS = GapSettings()
OFFSET = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
SURE = Certainty(5.0, 1.0, 0.1, 0.5, 2.0, 1.0, 0.3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, ""),
        ({"deviations": 2.9}, "standard deviations"),
        ({"peak": 0.09}, "resolution"),
        ({"peak": 0.015, "resolution": 0.01, "explained": 0.2}, "friction"),
        ({"across": -0.01}, "recording"),
        ({"moved": 3.5}, "physically possible"),
        ({"in_bounds": False}, "can have"),
        ({"across": None}, ""),
    ],
)
def test_each_doubt_is_told(change, words):
    doubt = replace(SURE, **change).doubt(SETTINGS.naming)
    assert words in doubt
    assert bool(doubt) == bool(words)


def test_the_size_of_a_spring_is_its_stiffness_not_its_offset(source):
    spring = catalogue()["joint_spring"].candidates(facts_of(source))[0]
    values = {"stiffness": Value(1.0, 0.5, "N m/rad"), "torque_at_zero": Value(9.0, 0.1, "N m")}
    assert deviations(spring, values) == pytest.approx(2.0)


def test_what_is_only_suspected_is_no_name():
    doubtful = Suspected(found(), {}, replace(SURE, deviations=1.0), "too small")
    small = replace(
        doubtful, effect=replace(found(), score=replace(score_of("stribeck"), gain=0.1))
    )
    assert decide([], [], [], [], SETTINGS, suspected=[small]).kind is Kind.NO_GAP
    assert decide([], [], [], [], SETTINGS, suspected=[doubtful]).kind is Kind.UNKNOWN
    assert decide([], [found()], [], [], SETTINGS, suspected=[small]).kind is Kind.NAMED


def test_what_changes_with_time_yields_to_what_does_not():
    warm = found("thermal_drift")
    rotor = replace(score_of("rotor_inertia"), gain=0.8 * warm.score.gain)
    assert yields_to_constant(warm, [warm.score, rotor], SETTINGS.rivals)
    weak = replace(rotor, gain=0.6 * warm.score.gain)
    assert not yields_to_constant(warm, [warm.score, weak], SETTINGS.rivals)
    drag = found("nonlinear_viscous")
    assert not yields_to_constant(drag, [drag.score, rotor], SETTINGS.rivals)
    assert yields_to_constant(drag, [replace(rotor, gain=drag.score.gain)], SETTINGS.rivals)
    assert not yields_to_constant(found("torque_offset"), [rotor], SETTINGS.rivals)
    unsettled = replace(drag, rivals=(rotor,))
    assert yields_to_constant(unsettled, [drag.score, rotor], SETTINGS.rivals)


def beside_an_offset(source, plain, name, drag=0.0, stiffness=0.0):
    """Recordings with a real offset, and a state with it and another effect at the same joint."""
    speed = plain.command.qd * (OFFSET > 0.0)
    more = OFFSET + drag * np.abs(speed) * speed + stiffness * np.eye(7)[4] * plain.q
    command = replace(plain.command, effort=plain.command.effort + more)
    shifted = source_of(replace(plain, command=command))
    blocks = blocks_of(shifted.datasets, windows_for(500.0, 10.0))
    facts = facts_of(shifted)
    rows = windowed_rows(blocks, facts, base_columns(shifted))
    nominal = nominal_fit(rows, facts)
    accepted = []
    for effect in ("torque_offset", name):
        h = [h for h in catalogue()[effect].candidates(facts) if h.joints == (4,)][-1]
        score = Score(0, h, extend(rows, nominal, [h]).fit, 0.1, 0.1)
        accepted.append(replace(found(effect), score=score, joints=(4,)))
    least = least_threshold(SETTINGS.thresholds)
    return shifted, SelectionState(rows, nominal, least, None).with_only(accepted)


@pytest.fixture
def two_accepted(source, plain):
    """An offset that is there, and a drag that is not."""
    return beside_an_offset(source, plain, "nonlinear_viscous")


def test_a_value_leans_on_the_effect_without_which_it_is_another_one(source, plain):
    """Of an offset and a spring, the spring would be stiffer if there were no offset."""
    _, state = beside_an_offset(source, plain, "joint_spring")
    final = final_estimates(state.rows, state.current, SETTINGS.significance)
    sure = [{n: replace(v, sd=0.01 * abs(v.value)) for n, v in p.items()} for p in final.parameters]
    final = replace(final, parameters=tuple(sure))
    _, spring = dependences(state.rows, state.current, final, SETTINGS.naming)
    (leaning,) = spring
    assert leaning.other.effect == "torque_offset"
    alone = state.with_only(state.accepted[1:])
    (values,) = final_estimates(alone.rows, alone.current, SETTINGS.significance).parameters
    assert leaning.without == pytest.approx(values[leaning.parameter].value, rel=1e-3)
    huge = [{n: replace(v, sd=1e3) for n, v in p.items()} for p in final.parameters]
    unsure = replace(final, parameters=tuple(huge))
    assert dependences(state.rows, state.current, unsure, SETTINGS.naming) == [(), ()]


@pytest.mark.parametrize("place", range(17, 28))
def test_final_values_explain_no_less_than_those_they_begin_from(source, plain, place):
    """Of a limit that nothing clips: a whole step may end below the torque that is always there."""
    _, state = beside_an_offset(source, plain, "torque_offset")
    facts = state.current.model.facts
    limits = [h for h in catalogue()["torque_saturation"].candidates(facts) if h.joints == (4,)]
    start = extend(state.rows, nominal_fit(state.rows, facts), [limits[place]])
    before = refit(state.rows, start, start.fit, start.accepted)
    final = final_estimates(state.rows, start, SETTINGS.significance)
    assert final.fit.gain_over(before) > -1e-4
    assert set(final.parameters[0]) == {"limit", "clipped_share"}


def test_a_sure_effect_stays_and_one_without_size_is_set_apart(two_accepted):
    kept, apart = set_apart(*two_accepted, SETTINGS)
    assert [a.candidate.effect for a in kept.accepted] == ["torque_offset"]
    assert [s.candidate.effect for s in apart] == ["nonlinear_viscous"]
    assert apart[0].doubt
    assert not apart[0].in_model


def test_of_a_spring_without_stiffness_the_torque_at_zero_is_named(source, plain):
    source, state = beside_an_offset(source, plain, "joint_spring")
    kept, apart = set_apart(source, state.with_only(state.accepted[1:]), SETTINGS)
    assert [a.place for a in kept.accepted] == [("torque_offset", (4,))]
    assert [s.effect.place for s in apart] == [("joint_spring", (4,))]
    asking = [replace(s, certainty=replace(SURE, across=0.3)) for s in apart]
    terms = terms_on_demand(source, kept, asking, SETTINGS)
    assert ("joint_spring", (4,)) not in [t.effect.place for t in terms]


def test_an_effect_without_which_a_sure_one_would_fall_stays_in_the_model(
    two_accepted, monkeypatch
):
    """The offset has its three deviations only beside the drag, which is too small to be named."""

    def leaning(source, state, settings, systematic=False):
        names = [a.candidate.effect for a in state.accepted]
        alone = Certainty(0.2, 1.0, 0.1, 0.5, 2.0, 1.0)
        beside = replace(alone, deviations=30.0)
        small = replace(beside, peak=0.05)
        judged = {"torque_offset": beside if len(names) > 1 else alone, "nonlinear_viscous": small}
        return [({}, judged[name]) for name in names]

    monkeypatch.setattr("ident.gap.naming.certainty.certainties", leaning)
    kept, apart = set_apart(*two_accepted, SETTINGS)
    assert [a.candidate.effect for a in kept.accepted] == ["torque_offset", "nonlinear_viscous"]
    assert [(s.candidate.effect, s.in_model) for s in apart] == [("nonlinear_viscous", True)]


@pytest.mark.parametrize(
    ("change", "stands"),
    [
        ({"held": 9.7}, True),
        ({"held": 7.0}, False),
        ({"held": None}, False),
        ({"held": 9.7, "peak": 0.05}, False),
        ({"held": 9.7, "across": -0.1}, False),
    ],
)
def test_an_effect_of_which_only_the_size_is_unsure_stands_in_the_model(
    two_accepted, monkeypatch, change, stands
):
    source, state = two_accepted
    drag = replace(SURE, deviations=1.2, **change)

    def judged(source, state, settings, systematic=False):
        return [({}, drag if a.place[0] == "nonlinear_viscous" else SURE) for a in state.accepted]

    monkeypatch.setattr("ident.gap.naming.certainty.certainties", judged)
    kept, apart = set_apart(source, state, SETTINGS)
    assert [s.candidate.effect for s in apart] == ["nonlinear_viscous"]
    assert (len(kept.accepted) == 2) is apart[0].in_model is stands


@pytest.mark.parametrize(("drag", "there"), [(0.0, False), (0.3, True)])
def test_with_its_power_held_a_drag_is_there_or_not(source, plain, drag, there):
    judged = certainties(*beside_an_offset(source, plain, "nonlinear_viscous", drag), SETTINGS)
    (_, offset), (_, found) = judged
    assert offset.held is None
    assert (found.held > SETTINGS.significance.z_fixed_settings) is there


def test_what_a_term_on_demand_makes_unsure_loses_its_name_and_stays(two_accepted, monkeypatch):
    source, state = two_accepted
    offset, drag = state.accepted
    term = Suspected(drag, {}, SURE, "", in_model=True)

    def sharing(source, state, settings, systematic=False):
        beside = replace(SURE, deviations=1.5)
        return [
            ({}, beside if a is offset and len(state.accepted) > 1 else SURE)
            for a in state.accepted
        ]

    monkeypatch.setattr("ident.gap.naming.certainty.certainties", sharing)
    whole, apart = sure_in_the_end(source, state.with_only([offset]), [term], SETTINGS)
    assert [a.place for a in whole.accepted] == [offset.place, drag.place]
    assert [(s.effect.place, s.in_model) for s in apart] == [
        (offset.place, True),
        (drag.place, True),
    ]
    monkeypatch.setattr(
        "ident.gap.naming.certainty.certainties", lambda _, s, *__: [({}, SURE)] * len(s.accepted)
    )
    assert sure_in_the_end(source, state.with_only([offset]), [term], SETTINGS)[1] == (term,)


def test_what_is_not_sure_by_the_errors_that_are_told_has_no_name(two_accepted, monkeypatch):
    """A spring was named, and told with 0.048 ± 0.025 N m/rad."""
    source, state = two_accepted
    first = state.accepted[0]

    def judged(source, state, settings, systematic=False):
        wide = replace(SURE, deviations=1.9) if systematic else SURE
        return [({}, wide if a is first else SURE) for a in state.accepted]

    monkeypatch.setattr("ident.gap.naming.certainty.certainties", judged)
    kept, apart = set_apart(source, state, SETTINGS)
    assert apart == ()
    whole, (lost,) = sure_in_the_end(source, kept, apart, SETTINGS)
    assert lost.effect is first
    assert lost.in_model
    assert "1.9 standard deviations" in lost.doubt
    assert len(whole.accepted) == 2


@pytest.mark.parametrize(
    ("across", "size", "stands"),
    [(0.1, 1.2, True), (0.1, 0.9, False), (None, 1.2, False), (-0.1, 1.2, False)],
)
def test_a_suspected_effect_stands_in_the_model_where_another_recording_asks_for_it(
    source, plain, monkeypatch, across, size, stands
):
    source, state = beside_an_offset(source, plain, "nonlinear_viscous", drag=0.1)
    offset, drag = state.accepted
    unsure = replace(SURE, deviations=size, across=across)

    def judged(source, state, settings, systematic=False):
        return [({}, SURE if a.place == offset.place else unsure) for a in state.accepted]

    monkeypatch.setattr("ident.gap.naming.terms_on_demand.certainties", judged)
    suspected = [Suspected(drag, {}, unsure, "too small")]
    terms = terms_on_demand(source, state.with_only([offset]), suspected, SETTINGS)
    assert (drag.place in [t.effect.place for t in terms if t.in_model]) == stands


@pytest.mark.parametrize(
    ("sizes", "carries"), [((1.0, 1.0), True), ((1.0, -1.0), False)], ids=["same", "opposite"]
)
def test_an_effect_carries_over_of_the_size_that_another_recording_gives_it(plain, sizes, carries):
    shifted = [
        replace(plain, command=replace(plain.command, effort=plain.command.effort + size * OFFSET))
        for size in sizes
    ]
    source = experiment(shifted, ["one.mcap", "two.mcap"])
    rows, nominal = nominal_of(source)
    h = next(h for h in catalogue()["torque_offset"].candidates(nominal.model.facts) if 4 in h.rows)
    end = extend(rows, nominal, [h])
    (across,) = across_recordings(end.design(rows), rows, end.fit, SETTINGS.cross_validation)
    assert (across.gain > 0.1) is carries
    assert (across.gain < 0.0) is not carries


def test_standard_deviations_span_the_recordings(source):
    offset = catalogue()["torque_offset"].candidates(facts_of(source))[0]
    values = {"offset": Value(2.0, 0.1, "N m")}
    apart = with_spread(offset, values, Across(np.array([0.3])))
    assert apart["offset"].sd == pytest.approx(0.6)
    assert with_spread(offset, values, Across(np.array([0.01])))["offset"].sd == 0.1


def fitted(rows: list[tuple[float, float]], torque: list[float]) -> Fit:
    """A fit of one common parameter and one effect."""
    columns = np.array(rows)
    normal = columns.T @ columns
    structure = SimpleNamespace(effects=[SimpleNamespace(width=1)])
    x = np.linalg.pinv(normal) @ columns.T @ np.array(torque)
    return Fit(structure, x, np.ones((1, 1)), np.ones((1, 1), dtype=np.int64), normal)


def test_recordings_that_know_an_effect_alike_spread_as_the_jackknife_says():
    one, other = [(1.0, 1.0), (1.0, -1.0)], [(1.0, 1.0), (1.0, -1.0)]
    torque = [2.0, -2.0], [3.0, -3.0]  # sizes 2 and 3
    every = fitted(one + other, [*torque[0], *torque[1]])
    left_out = [fitted(other, torque[1]), fitted(one, torque[0])]
    assert relative_spread(left_out, every, 0, 0.1) == pytest.approx([0.5 / 2.5])


def test_a_recording_that_hardly_knows_an_effect_does_not_make_it_unsure():
    sharp, blunt = [(1.0, 1.0), (1.0, -1.0)], [(1.0, 0.01), (1.0, -0.01)]
    torque = [2.0, -2.0], [0.15, -0.05]  # the second one alone: 10
    every = fitted(sharp + blunt, [*torque[0], *torque[1]])
    left_out = [fitted(blunt, torque[1]), fitted(sharp, torque[0])]
    assert left_out[0].effects[0] == pytest.approx([10.0])
    assert relative_spread(left_out, every, 0, 0.1)[0] < 0.05


@pytest.mark.parametrize(("calibrations", "asked"), [(1, 0.0), (0, 0.0), (1, 99.0)])
def test_a_term_that_passes_all_that_a_name_has_to_may_be_named(source, plain, calibrations, asked):
    """The search leaves a place for good that was not sure beside what it had then."""
    source, state = beside_an_offset(source, plain, "joint_spring")
    place = ("torque_offset", (4,))
    gain = dict.fromkeys(state.threshold.gain, asked)
    threshold = replace(state.threshold, gain=gain)
    state = replace(state, threshold=threshold, calibrations=calibrations).with_dropped([place])
    terms = terms_on_demand(source, state.with_only([]), [], SETTINGS)
    (offset,) = [t for t in terms if t.effect.place == place]
    assert (not offset.doubt) is (calibrations == 1 and asked == 0.0)


def test_of_two_effects_of_one_kind_at_one_place_one_may_be_named(two_accepted, monkeypatch):
    source, state = two_accepted
    offset, _ = state.accepted
    twin = replace(offset)
    unsure = replace(SURE, deviations=1.0, held=50.0)

    def judged(source, state, settings, systematic=False):
        return [({}, unsure if a is twin else SURE) for a in state.accepted]

    monkeypatch.setattr("ident.gap.naming.certainty.certainties", judged)
    state, apart = set_apart(source, state.with_only([offset, twin]), SETTINGS)
    assert [s.effect is twin for s in apart] == [True]
    whole, apart = sure_in_the_end(source, state, apart, SETTINGS)
    assert [a is twin for a in whole.accepted] == [False, True]
    assert [a is offset for a in not_among(apart, whole.accepted)] == [True]
