"""Two effects, one of which the other's form, or the arm's fit, could hide."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from closed_loop import estimates_of, nominal_of, recorded, source_of, sticking, wam

from ident.dynamics.compiled_chain import torques
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts, Observed
from ident.gap.data.blocks import SEARCHED
from ident.gap.data.experiment import facts_of
from ident.gap.options import Options
from ident.gap.regression.model_columns import ModelStructure
from ident.gap.regression.weighted_fit import fit
from ident.gap.search import search
from ident.gap.selection import acceptance
from ident.gap.selection.acceptance import next_effects, try_pair
from ident.gap.selection.candidates import all_candidates, examine
from ident.gap.selection.masked_pairs import masked_pair
from ident.gap.selection.refinement import refine_nonlinear_parameters
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.identification.identify import identify, model_of
from ident.simulation.arm import Term, term
from wamctl.arm.recording import Recording

OPTIONS = Options(null_runs=1)
SETTINGS = OPTIONS.settings


@term
def one_way(t, q, qd, load, joint, settings, resistance, level):
    """Drag that is larger in one direction."""
    resistance[joint] += settings[0] * abs(qd[joint])


def named(log: Recording) -> tuple[str, list[str]]:
    verdict = search(source_of(log), OPTIONS, lambda _: None).verdict
    return str(verdict.kind), sorted(f.candidate.effect for f in verdict.effects)


@pytest.mark.thorough
def test_drag_in_one_direction_is_no_error_of_a_form_that_follows_the_direction():
    """The Stribeck effect's height at standstill hangs on its form; that it is there does not."""
    arm = wam(Term(sticking, 1, (0.8, 0.05)), Term(one_way, 1, (0.03,)))
    kind, names = named(recorded(arm, moving=(1, 3)))
    assert (kind, names) == ("named", ["asymmetric_viscous", "stribeck"])


@pytest.mark.thorough
def test_a_sticking_first_joint_on_a_tilted_base():
    arm = wam(Term(sticking, 0, (0.78, 0.12)))
    gravity = arm.chain.gravity + np.cross([-0.0184, 0.0069, 0.0], arm.chain.gravity)
    arm = replace(arm, chain=arm.chain._replace(gravity=gravity))
    kind, names = named(recorded(arm))
    assert (kind, names) == ("named", ["gravity_tilt", "stribeck"])


@term
def harness(t, q, qd, load, joint, settings, resistance, level):
    """A spring that hardens with the distance from where it rests."""
    far = q[joint] - settings[1]
    resistance[joint] += settings[0] * far * (1.0 + settings[2] * far * far)


@term
def sling(t, q, qd, load, joint, settings, resistance, level):
    """A spring that gives way."""
    resistance[joint] += settings[0] * np.tanh(q[joint] / settings[1])


def test_two_effects_of_one_joint_that_hold_beside_each_other():
    arm = wam(Term(sling, 5, (0.008, 0.7)))
    rotor = np.zeros((7, 7))
    rotor[5, 5] = 0.008
    rows, nominal = nominal_of(source_of(recorded(replace(arm, armature=rotor))))
    state = SelectionState(rows, nominal, least_threshold(SETTINGS.thresholds), None)
    own = [h for h in all_candidates(nominal.model.facts) if h.joints == (5,)]
    _, scores = examine(rows, nominal, own, SETTINGS.scoring)
    first = next(s for s in scores if s.candidate.effect == "rotor_inertia")
    pair = try_pair(state, first, own, SETTINGS)
    assert [f.candidate.effect for f in pair] == ["rotor_inertia", "joint_spring"]
    offset = next(s for s in scores if s.candidate.effect == "torque_offset")
    assert try_pair(state, offset, own, SETTINGS) == []


def test_two_effects_of_one_joint_that_hide_each_other():
    """A swinging spring and rotor pull against each other: either alone gains less than asked."""
    arm = wam(Term(sling, 5, (0.04, 2.0)))
    rotor = np.zeros((7, 7))
    rotor[5, 5] = 0.008
    asked = SETTINGS.model_copy(
        update={"thresholds": SETTINGS.thresholds.model_copy(update={"min_gain": 1.2})}
    )
    source = source_of(recorded(replace(arm, armature=rotor)))
    rows, nominal = nominal_of(source)
    state = SelectionState(rows, nominal, least_threshold(asked.thresholds), None)
    candidates = all_candidates(nominal.model.facts)
    assert next_effects(state, candidates, asked)[0] == []
    pair = masked_pair(state, candidates, asked)
    assert {a.place for a in pair} == {("joint_spring", (5,)), ("rotor_inertia", (5,))}
    found = search(source, replace(OPTIONS, settings=asked), lambda _: None)
    named = {f.place for f in found.verdict.effects}
    assert named == {("joint_spring", (5,)), ("rotor_inertia", (5,))}


@term
def lean(t, q, qd, load, joint, settings, resistance, level):
    """A constant torque."""
    resistance[joint] += settings[0]


def test_what_effect_free_data_explain_as_well_blocks_nothing():
    rotor = np.zeros((7, 7))
    rotor[5, 5] = 0.02
    arm = replace(wam(Term(lean, 5, (0.02,))), armature=rotor)
    rows, nominal = nominal_of(source_of(recorded(arm)))
    least = least_threshold(SETTINGS.thresholds)
    offsets = replace(least, gain=least.gain | {"torque_offset": 100.0})
    kinds = "torque_offset", "rotor_inertia"
    own = [catalogue()[name].at((5,)) for name in kinds]
    fresh, scores = next_effects(SelectionState(rows, nominal, offsets, None), own, SETTINGS)
    assert [s.candidate.effect for s in scores] == list(kinds)
    assert [a.candidate.effect for a in fresh] == ["rotor_inertia"]


@pytest.fixture(scope="module")
def two_rotors() -> SelectionState:
    """The start of a search on an arm whose two joints of a differential have a rotor each."""
    rotors = np.zeros((7, 7))
    rotors[[4, 5], [4, 5]] = 0.008
    rows, nominal = nominal_of(source_of(recorded(replace(wam(), armature=rotors))))
    return SelectionState(rows, nominal, least_threshold(SETTINGS.thresholds), None)


def wrist_inertias(state: SelectionState) -> list[Candidate]:
    found = all_candidates(state.current.model.facts)
    kinds = "coupled_inertia", "rotor_inertia"
    return [h for h in found if h.effect in kinds and {4, 5}.issuperset(h.joints)]


def test_an_effect_yields_to_its_special_cases_together(two_rotors):
    """A coupling with what it adds to either joint explains more than either rotor alone."""
    fresh, scores = next_effects(two_rotors, wrist_inertias(two_rotors), SETTINGS)
    assert scores[0].candidate.effect == "coupled_inertia"
    assert {a.place for a in fresh} == {("rotor_inertia", (4,)), ("rotor_inertia", (5,))}


def test_an_effect_that_fails_leaves_the_joint_to_its_special_cases(two_rotors, monkeypatch):
    def only_single(design, score, now, settings):
        return len(score.candidate.joints) == 1

    monkeypatch.setattr(acceptance, "passes_cross_validation", only_single)
    fresh, scores = next_effects(two_rotors, wrist_inertias(two_rotors), SETTINGS)
    assert scores[0].candidate.effect == "coupled_inertia"
    assert {a.place for a in fresh} == {("rotor_inertia", (4,)), ("rotor_inertia", (5,))}


def test_no_two_effects_hide_each_other_where_there_are_none(nothing_hidden):
    rows, nominal = nothing_hidden.rows, nothing_hidden.start
    state = SelectionState(rows, nominal, nothing_hidden.threshold, None)
    assert masked_pair(state, all_candidates(nominal.model.facts), SETTINGS) == []


def test_joints_that_turn_round_all_the_time_hide_no_two_effects(nothing_hidden):
    """Friction may be anything there."""
    rows, nominal = nothing_hidden.rows, nothing_hidden.start
    slow = replace(nominal, model=replace(nominal.model, slow=np.full(7, 100.0)))
    state = SelectionState(rows, slow, nothing_hidden.threshold, None)
    assert masked_pair(state, all_candidates(nominal.model.facts), SETTINGS) == []


def test_the_stiffness_of_a_spring_that_hardens_is_as_uncertain_as_its_form():
    arm = wam(Term(harness, 3, (0.6, 1.2, 0.03)))
    found = search(source_of(recorded(arm, moving=(1, 3))), OPTIONS, lambda _: None)
    (values,) = estimates_of(found)
    stiffness = values["stiffness"]
    assert 1.0 < stiffness.value / 0.6 < 1.1
    half_width = 3.0**0.5 * stiffness.sd  # of the rectangle that the error of its form spans
    assert abs(stiffness.value - 0.6) < 1.1 * half_width < 0.15 * 0.6


@pytest.fixture
def tilt(nothing_hidden) -> tuple[ArmFacts, Candidate]:
    facts = nothing_hidden.start.model.facts
    (hypothesis,) = catalogue()["gravity_tilt"].candidates(facts)
    return facts, catalogue()["gravity_tilt"].moved(hypothesis, {"first_link": 1.0})


def test_a_tilt_is_the_same_for_arms_that_a_level_base_cannot_tell_apart(tilt):
    """The first link's own first moments are felt on a tilted base only: any value may stand."""
    facts, hypothesis = tilt
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (20, 7))
    rest = np.zeros_like(q)
    values = np.array([0.02, -0.01, 0.3, -0.2])
    heavy = np.zeros(70)
    heavy[6:8] = 1.3, -0.4
    columns, whole = [], []
    for delta in (facts.delta, facts.delta + heavy):
        other = replace(facts, delta=delta)
        still = [rest] * 10
        seen = Observed(other, 500.0, q[:, 0], q, *still, np.sign)
        columns.append(catalogue()["gravity_tilt"].columns(seen, hypothesis) @ values)
        arm = replace(wam(), delta=delta)
        level = torques(arm.chain, delta, q, rest, rest)
        arm = catalogue()["gravity_tilt"].simulated(arm, hypothesis, values)
        cosine, sine = arm.terms[0].settings
        total = torques(arm.chain, delta, q, rest, rest) - level
        total[:, 0] += cosine * np.cos(q[:, 0]) + sine * np.sin(q[:, 0])
        whole.append(total)
    assert columns[0] == pytest.approx(columns[1], abs=1e-9)
    assert whole[0] == pytest.approx(whole[1], abs=1e-9)
    assert whole[0] == pytest.approx(columns[0], abs=0.01)  # the columns are of first order
    assert np.ptp(whole[0][:, 0]) > 0.3


def test_regions_and_reversal_curves_agree_once_settled(nothing_hidden):
    start = nothing_hidden.start
    design = start.design(nothing_hidden.rows)
    again = fit(design.equations.of(SEARCHED), ModelStructure(start.model.shapes), start.fit.sigma)
    ratio = np.log(again.sigma / start.fit.sigma)[again.counts > 0]
    assert np.abs(ratio).max() < 0.01


def test_a_tuned_drag_never_turns_into_friction_that_falls_with_speed(nothing_hidden):
    rows, start = nothing_hidden.rows, nothing_hidden.start
    drags = [s for s in nothing_hidden.first_scores if s.candidate.effect == "nonlinear_viscous"]
    tried = [
        t for s in drags[:2] for t in refine_nonlinear_parameters(rows, start, s, SETTINGS.scoring)
    ]
    assert tried
    for score in tried:
        (drag,) = score.candidate.coefficients
        power = score.candidate.parameters.power
        assert drag.unit == f"N m (s/rad)^{power:g}"
        assert (drag.lower == 0.0) == (power < 1.0)
        assert score.values[0] >= drag.lower
    effect = catalogue()["nonlinear_viscous"]
    drag = effect.at((0,), effect.Parameters(2.0))
    assert not effect.is_plausible(drag, np.array([0.2]), (-0.1, 1.0), False)
    assert effect.is_plausible(drag, np.array([0.2]), (-0.001, 1.0), False)
    assert effect.is_plausible(drag, np.array([-0.2]), (0.3, 1.0), False)


@pytest.mark.thorough
def test_a_small_rotor_of_the_wrist_is_no_delay_of_its_friction():
    """Torque that is smoothed, as a delay of another size would be, imitates inertia there."""
    arm = wam()
    arm = replace(arm, armature=np.diag([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 6e-4]))
    verdict = search(source_of(recorded(arm)), OPTIONS, lambda _: None).verdict
    assert str(verdict.kind) == "named"
    assert [(f.candidate.effect, f.candidate.joints) for f in verdict.effects] == [
        ("rotor_inertia", (6,))
    ]


def test_a_delay_is_of_the_size_that_its_columns_are_made_for():
    effect = catalogue()["torque_delay"]
    grid = effect.nonlinear[0].grid
    for about in grid:
        (delay,) = effect.coefficients(effect.Parameters(about), "")
        assert delay.lower < about < delay.upper
    bounds = [effect.coefficients(effect.Parameters(d), "")[0] for d in grid]
    pairs = [(a, b) for a, b in itertools.pairwise(bounds)]
    assert all(a.upper >= b.lower for a, b in pairs)  # any delay is within reach of a column


@pytest.mark.parametrize("commanded", [True, False])
def test_no_command_acts_at_one_joint_before_it_is_given(commanded):
    """A bristle of a wrist that bends by half a milliradian looks like a torque 40 ms early."""
    facts = replace(facts_of(source_of(recorded(wam()))), commanded=commanded)
    places = {
        h.joints for h in catalogue()["torque_delay"].candidates(facts) if h.parameters.about < 0.0
    }
    assert facts.moving_joints in places
    assert ((6,) in places) is not commanded


@term
def bent(t, q, qd, load, joint, settings, resistance, level):
    """Something that the model made before has never described, nor changed since."""
    resistance[joint] += settings[0] * np.sin(3.0 * q[joint])


@pytest.mark.thorough
def test_a_constant_error_of_the_reference_model_is_no_change():
    odd = Term(bent, 4, (0.004,))
    before = source_of(recorded(wam(odd)))
    known = model_of(identify(before.datasets, before.arm))
    logs = (source_of(recorded(wam(*t), 1)) for t in ((odd,), (odd, Term(constant, 3, (0.3,)))))
    same, moved = (
        search(replace(log, reference_model=known), OPTIONS, lambda _: None) for log in logs
    )
    assert str(same.verdict.kind) == "no_gap"
    assert [(f.candidate.effect, f.candidate.joints) for f in moved.verdict.effects] == [
        ("torque_offset", (3,))
    ]
    assert str(moved.verdict.kind) == "named"


@term
def constant(t, q, qd, load, joint, settings, resistance, level):
    """A torque that is always there."""
    resistance[joint] += settings[0]
