"""Play: the simulated arm that has it, and its name."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import moved, recorded, source_of, wam

from ident.dynamics.compiled_chain import torques
from ident.effects.catalogue import catalogue
from ident.effects.observation import Observed
from ident.gap.data.experiment import facts_of
from ident.gap.options import Options
from ident.gap.regression.residuals import residuals
from ident.gap.results.verdict import Kind
from ident.gap.search import search
from ident.gap.settings import Transients
from ident.gap.transients.detect import Transient
from ident.gap.transients.exclude import explained_by_accepted

HALF = 2e-3
COUNT = 2.4e-4  # of the coarsest encoder, on the joint


MOTOR = [0.2, 0.2, 0.06, 0.03, 3e-4, 3e-4, 1e-4]  # kg m^2


def with_play(joint, half, rubbing=0.0):
    """The simulated arm with play at a joint, as the effect adds it."""
    effect = catalogue()["backlash"]
    shape = effect.Parameters(half, rubbing=rubbing, motor_inertia=MOTOR[joint])
    return effect.simulated(wam(), effect.at((joint,), shape, rows=range(7)), np.array([half]))


@pytest.mark.parametrize("joint", [1, 4])
def test_an_arm_with_hardly_any_play_moves_as_one_without(joint):
    assert moved(with_play(joint, 1e-7)) == pytest.approx(moved(wam()), abs=2 * COUNT)


def test_play_at_the_elbow_shows_in_its_encoder_by_about_its_width():
    apart = moved(with_play(3, HALF)) - moved(wam())
    assert 0.2 * HALF < np.abs(apart[:, 3]).max() < 4 * HALF


@pytest.fixture(scope="module", params=[0.0, pytest.param(0.4, marks=pytest.mark.thorough)])
def loosened(request):
    """Search in a recording of an arm with play at joint 5, whose friction the link may share."""
    log = recorded(with_play(4, 1.5e-3, request.param))
    return search(source_of(log), Options(null_runs=1), lambda _: None)


def test_play_is_named_with_its_joint_and_size(loosened):
    (effect,) = loosened.verdict.effects
    assert (effect.candidate.effect, effect.candidate.joints) == ("backlash", (4,))
    assert loosened.verdict.kind == Kind.NAMED
    assert effect.score.values == pytest.approx([1.5e-3], rel=0.15)


def test_an_impact_at_the_end_of_the_play_is_no_transient(loosened):
    """At the stop the model may fail; elsewhere a failure that pushes one way is an event."""
    rows, end, joint = loosened.rows, loosened.end, 4
    design = end.design(rows)
    blows = np.abs(design.effect_columns(0, joint)[:, 0])
    push = np.abs(np.convolve(residuals(design, end.fit)[joint].values, np.ones(3), "same"))
    quiet = np.where(blows < np.quantile(blows, 0.2), push, 0.0)
    for at, blow in ((int(blows.argmax()), True), (int(quiet.argmax()), False)):
        here = np.zeros(len(blows), dtype=bool)
        here[max(at - 1, 0) : at + 2] = True
        transient = Transient(0, 0.0, 1.0, (joint,), np.zeros(7), np.zeros(7), 1.0, here, blows)
        assert explained_by_accepted(rows, end, transient, Transients()) is blow


@pytest.mark.thorough
def test_play_of_an_arm_on_a_tilted_base():
    """The link falls through its play as the tilted base pulls it; its size stays unsure."""
    arm = with_play(0, 4e-3)
    gravity = arm.chain.gravity + np.cross([-0.05, 0.02, 0.0], arm.chain.gravity)
    arm = replace(arm, chain=arm.chain._replace(gravity=gravity))
    verdict = search(source_of(recorded(arm)), Options(null_runs=1), lambda _: None).verdict
    found = [*verdict.effects, *verdict.suspected]
    assert sorted(f.candidate.effect for f in found) == ["backlash", "gravity_tilt"]
    assert "gravity_tilt" in [f.candidate.effect for f in verdict.effects]


def test_a_motor_with_play_is_a_coordinate_of_its_own():
    arm, loosened = wam(), with_play(4, HALF)
    assert loosened.motor[4] == MOTOR[4]
    assert loosened.rows.shape == (9, 8)
    assert replace(loosened, motor=arm.motor).rows.shape == (7, 7)


def test_an_arm_of_which_two_joints_move_can_have_play(source):
    """Of the others' links nothing is known: their inertia is none."""
    facts, delta = facts_of(source), np.zeros(70)
    delta[30:40] = wam().delta[30:40]
    facts = replace(facts, delta=delta, moving=np.isin(np.arange(7), [1, 3]))
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 7))
    load = torques(facts.chain, delta, q, q, q)
    seen = Observed(
        facts,
        100.0,
        q[:, 0],
        q,
        q,
        q,
        q,
        q,
        q,
        load,
        0 * load,
        load,
        np.ones(7),
        np.ones(7),
        np.sign,
    )
    effect = catalogue()["backlash"]
    for hypothesis in effect.candidates(facts):
        assert np.isfinite(effect.columns(seen, hypothesis)).all()
