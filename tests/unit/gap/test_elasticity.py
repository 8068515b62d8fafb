"""A transmission that gives: the simulated arm that has it, and its name."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import moved, nominal_of, recorded, source_of, wam
from test_verdict import found as accepted

from ident.effects.catalogue import catalogue
from ident.gap.options import Options
from ident.gap.regression.current_model import extend
from ident.gap.results.verdict import Kind
from ident.gap.search import search
from ident.gap.selection.estimates import final_estimates
from ident.gap.settings import Significance

COUNT = 2.4e-4  # of the coarsest encoder, on the joint
MOTOR = [0.2, 0.2, 0.06, 0.03, 3e-4, 3e-4, 1e-4]  # kg m^2


def springy(joint, give, damped=0.1):
    """The simulated arm whose joint hangs on a spring, as the effect adds it."""
    effect = catalogue()["joint_elasticity"]
    shape = effect.Parameters(give, rubbing=0.0, damped=damped, motor_inertia=MOTOR[joint])
    return effect.simulated(wam(), effect.at((joint,), shape, rows=range(7)), np.array([give]))


@pytest.mark.parametrize("joint", [1, 4])
def test_an_arm_on_a_stiff_spring_moves_as_one_on_none(joint):
    assert moved(springy(joint, 1e-6)) == pytest.approx(moved(wam()), abs=2 * COUNT)


@pytest.mark.parametrize("joint", range(7))
def test_an_arm_on_a_soft_spring_follows(joint):
    """The motor is held, so that only the arm's load moves it by a few counts."""
    apart = moved(springy(joint, 1e-3)) - moved(wam())
    assert np.abs(apart).max() < 40 * COUNT


def test_a_spring_is_named_with_its_joint_and_size():
    found = search(source_of(recorded(springy(3, 1e-3))), Options(null_runs=1), lambda _: None)
    (effect,) = found.verdict.effects
    assert (effect.candidate.effect, effect.candidate.joints) == ("joint_elasticity", (3,))
    assert found.verdict.kind == Kind.NAMED
    assert effect.score.values == pytest.approx([1e-3], rel=0.1)


def estimated(rows, nominal, give, settings):
    """The compliance of the transmission of joint 4, whose swing was looked for at a compliance."""
    effect = catalogue()["joint_elasticity"]
    first = next(h for h in effect.candidates(nominal.model.facts) if h.joints == (3,))
    h = effect.moved(first, {"give": give, "damped": 0.4, "motor_inertia": MOTOR[3]})
    end = extend(rows, nominal, [h])
    score = replace(accepted("joint_elasticity").score, candidate=h, fit=end.fit)
    item = replace(accepted("joint_elasticity"), score=score, joints=(3,))
    ((values),) = final_estimates(rows, end, settings, [item]).parameters
    return values["compliance"]


def test_a_swing_that_is_another_one_makes_a_compliance_no_larger_than_it_is():
    rows, nominal = nominal_of(source_of(recorded(springy(3, 4e-4))))
    never = Significance(min_consistent_share=1.0)
    compliance = estimated(rows, nominal, 0.05, never)
    assert compliance.value == pytest.approx(4e-4, rel=0.2)
    assert 0.3 * compliance.value < compliance.sd < compliance.value


def test_slow_motion_shows_how_far_a_transmission_gives_wherever_its_swing_was_looked_for():
    """The compliance in the columns tells the swing, of which slow motion knows next to nothing."""
    rows, nominal = nominal_of(source_of(recorded(springy(3, 4e-4))))
    for give in (4e-4, 2e-3):
        compliance = estimated(rows, nominal, give, Significance())
        assert compliance.value == pytest.approx(4e-4, rel=0.2)
        assert compliance.sd < 0.2 * compliance.value
