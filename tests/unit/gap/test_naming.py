"""Effects in forms that the catalogue does not have, alone and beside another."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import (
    estimates_of,
    loosening,
    nominal_of,
    push,
    recorded,
    source_of,
    sticking,
    wam,
)

from ident.effects.catalogue import catalogue
from ident.gap.options import Options
from ident.gap.regression.current_model import extend
from ident.gap.regression.feasible_fit import feasible_fit
from ident.gap.results.held_out_error import before_and_after, held_out
from ident.gap.results.outcome import SearchResult
from ident.gap.results.verdict import Kind
from ident.gap.search import _exclude_transients, search
from ident.gap.selection.acceptance import next_effects
from ident.gap.selection.candidates import all_candidates
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.simulation.arm import Term

OPTIONS = Options(null_runs=1)
STICKING = Term(sticking, 3, (0.8, 0.08))
PUSH = tuple(Term(push, j, (size, 30.0, 0.6)) for j, size in enumerate((2.0, -1.5, 0.8)))


def searched(arm) -> SearchResult:
    return search(source_of(recorded(arm)), OPTIONS, lambda _: None)


def named(found: SearchResult) -> list[tuple[str, tuple[int, ...]]]:
    return [(f.candidate.effect, f.candidate.joints) for f in found.verdict.effects]


@pytest.fixture(scope="module")
def both() -> SearchResult:
    """An elbow that sticks at low speed, and a push at the upper arm."""
    return searched(wam(STICKING, *PUSH))


@pytest.mark.thorough
def test_a_push_beside_another_effect_hides_neither(both):
    assert both.verdict.kind == Kind.NAMED
    assert named(both) == [("stribeck", (3,))]
    (transient,) = both.verdict.transients
    assert transient.start_s == pytest.approx(30.0, abs=0.2)
    assert transient.end_s == pytest.approx(30.6, abs=0.2)
    assert {0, 1, 2} <= set(transient.joints)


def test_no_push_is_left_out_while_an_effect_explains_more():
    """Beside a part of what is missing, another part may stand out for a while."""
    weak = [Term(push, j, (size, 30.0, 0.6)) for j, size in enumerate((0.2, -0.15, 0.1))]
    source = source_of(recorded(wam(STICKING, *weak)))
    rows, nominal = nominal_of(source)
    state = SelectionState(rows, nominal, least_threshold(OPTIONS.settings.thresholds), None)
    _, scores = next_effects(state, all_candidates(nominal.model.facts), OPTIONS.settings)
    assert scores[0].candidate.effect == "stribeck"
    state = replace(state, scores=(scores,))
    other = catalogue()["torque_offset"].at((6,))
    for h, told in ((other, False), (scores[0].candidate, True)):
        larger = extend(rows, nominal, [h])
        assert bool(_exclude_transients(source, state, larger, OPTIONS).transients) == told


def test_the_size_is_within_its_interval_whatever_the_form(both):
    (values,) = estimates_of(both)
    extra = values["extra_friction"]
    assert extra.value == pytest.approx(0.8, abs=3 * extra.sd)
    assert extra.value == pytest.approx(0.8, rel=0.15)


def test_each_of_several_pushes_is_told():
    pushes = [Term(push, j, (2.0, start, 0.6)) for start in (9.0, 24.0, 37.5) for j in (0, 1)]
    found = search(source_of(recorded(wam(*pushes), moving=(0, 1, 3))), OPTIONS, lambda _: None)
    assert found.verdict.kind == Kind.NAMED
    assert named(found) == []
    starts = [b.start_s for b in found.verdict.transients]
    assert starts == pytest.approx([9.0, 24.0, 37.5], abs=0.2)
    assert all({0, 1} <= set(b.joints) for b in found.verdict.transients)


@pytest.mark.thorough
def test_friction_that_nearly_vanishes_during_the_run_leaves_a_possible_arm():
    drag = 0.95 * wam().viscous[0]
    found = searched(wam(Term(loosening, 0, (drag, 73.0))))
    assert found.verdict.kind == Kind.NAMED
    assert named(found) == [("thermal_drift", (0,))]
    (values,) = estimates_of(found)
    end_s = found.source.datasets[0].samples / found.source.datasets[0].rate_hz
    assert values["viscous_change"].value == pytest.approx(-drag * end_s / 73.0, rel=0.02)
    count = len(found.rows.base_parameters)
    before, after = (feasible_fit(found.source, p.fit, count).x for p in (found.start, found.end))
    assert held_out(found, before_and_after(found, before, after)).closed > 0.95


def test_a_torque_constant_that_repeats_with_the_motors_angle_is_ripple():
    log = recorded(wam(), moving=(1, 3))
    effort = log.command.effort.copy()
    effort[:, 3] /= 1 + 0.15 * np.sin(2 * 18.0 * log.q[:, 3] + 0.4)  # the drive gives so much more
    log = replace(log, command=replace(log.command, effort=effort))
    found = search(source_of(log), OPTIONS, lambda _: None)
    assert found.verdict.kind == Kind.NAMED
    assert {(f.candidate.effect, f.candidate.joints) for f in found.verdict.effects} == {
        ("torque_ripple", (3,))
    }
    values = estimates_of(found)[0]
    assert values["order"].value == 2.0
    assert values["sine"].unit == "1"
    # the motor turns backwards with this joint: sin(36 q + 0.4) = sin(0.4 - 2 theta)
    assert values["sine"].value == pytest.approx(-0.15 * np.cos(0.4), rel=0.03)
    assert values["cosine"].value == pytest.approx(0.15 * np.sin(0.4), rel=0.1)


@pytest.mark.thorough
def test_a_tilted_base_is_no_spring_at_the_first_joint():
    arm = wam()
    tilt = np.array([0.012, -0.009, 0.0])
    gravity = arm.chain.gravity + np.cross(tilt, arm.chain.gravity)
    gravity *= np.linalg.norm(arm.chain.gravity) / np.linalg.norm(gravity)
    found = searched(replace(arm, chain=arm.chain._replace(gravity=gravity)))
    assert found.verdict.kind == Kind.NAMED
    assert [name for name, _ in named(found)] == ["gravity_tilt"]
    (values,) = estimates_of(found)
    assert values["tilt_x"].value == pytest.approx(0.012, rel=0.03)
    assert values["tilt_y"].value == pytest.approx(-0.009, rel=0.03)


@pytest.mark.thorough
def test_a_drive_that_clips_now_and_then_is_no_contact():
    arm = wam()
    limit = arm.limit.copy()
    limit[4] = 0.36
    found = searched(replace(arm, limit=limit))
    assert found.verdict.kind == Kind.NAMED
    assert named(found) == [("torque_saturation", (4,))]
    (values,) = estimates_of(found)
    assert values["limit"].value == pytest.approx(0.36, rel=0.005)
    assert values["limit"].unit == "N m"


def test_levers_of_a_differential_that_nobody_described_are_found():
    arm = wam()
    shared = np.zeros((2, 7))
    shared[:, 1], shared[:, 2] = 1.0, (0.6, -0.6)
    arm = replace(
        arm,
        friction_rows=np.vstack([arm.friction_rows, shared]),
        coulomb=np.append(arm.coulomb, (0.5, 0.4)),
        bristle=np.append(arm.bristle, (0.0, 0.0)),
    )
    log = recorded(arm, moving=(1, 2, 3))
    urdf_only = {"robot.urdf": log.attachments["robot.urdf"]}
    found = search(source_of(replace(log, attachments=urdf_only)), OPTIONS, lambda _: None)
    assert named(found) == [("coupled_friction", (1, 2))]
    (values,) = estimates_of(found)
    assert values["ratio"].value == pytest.approx(0.6, abs=0.01)
    assert values["coulomb_1"].value == pytest.approx(0.5, rel=0.05)
    assert values["coulomb_2"].value == pytest.approx(0.4, rel=0.05)
