"""Values of effects whose form is not the one that is searched, or none of the catalogue's."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import nominal_of, recorded, source_of, wam

from ident.effects.catalogue import catalogue
from ident.effects.joint_spring import EFFECT
from ident.gap.regression.current_model import extend
from ident.gap.selection.candidates import examine
from ident.gap.selection.estimates import final_estimates
from ident.gap.selection.rivals import accept
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.gap.settings import GapSettings, Significance
from ident.simulation.arm import Term, term

JOINT, STIFFNESS, REST = 3, 2.0, 1.4  # from 0, N m/rad, rad
HARDENING = 0.2  # N m/rad^3
EXTRA, SPEED = 0.6, 0.15  # N m, rad/s
SHARE = 0.1  # of the load, mean of driving and braking


@term
def cable(t, q, qd, load, joint, settings, resistance, level):
    x = q[joint] - settings[1]
    resistance[joint] += settings[0] * x + settings[2] * x * x * x


@pytest.mark.parametrize("hardening", [0.0, HARDENING])
def test_a_spring_that_hardens_is_told_with_its_stiffness_at_rest(hardening):
    """As one that does not, its stiffness was off by all that its interval allowed for."""
    arm = wam(Term(cable, JOINT, (STIFFNESS, REST, hardening)))
    rows, nominal = nominal_of(source_of(recorded(arm, 1)))
    end = extend(rows, nominal, [EFFECT.at((JOINT,))])
    final = final_estimates(rows, end, Significance(), systematic=True)
    (values,), (found,) = final.parameters, final.effects
    error = values["stiffness"].value - STIFFNESS
    assert abs(error) < 2.0 * values["stiffness"].sd < 0.02 * STIFFNESS
    assert ("hardening" in values) == (hardening > 0.0)
    simulated = catalogue()["joint_spring"].simulated(wam(), found, final.fit.effects[0])
    assert len(simulated.terms) == (2 if hardening else 1)


@term
def sech(t, q, qd, load, joint, settings, resistance, level):
    level[joint] += settings[0] / np.cosh(qd[joint] / settings[1])


def test_an_interval_holds_the_forms_that_come_near():
    """The true curve is none of them: that the likelihood prefers one does not make it right."""
    asked = GapSettings()
    sharp = asked.rivals.model_copy(update={"form_gain": 1e-6, "log_likelihood": 1e-6})
    asked = asked.model_copy(update={"rivals": sharp})
    rows, start = nominal_of(source_of(recorded(wam(Term(sech, JOINT, (EXTRA, SPEED))), 1)))
    state = SelectionState(rows, start, least_threshold(asked.thresholds, False), None)
    candidates = [
        h for h in catalogue()["stribeck"].candidates(start.model.facts) if h.joints == (JOINT,)
    ]
    design, scores = examine(rows, start, candidates, asked.scoring)
    found = accept(state, design, scores[0], (), asked)
    assert found.near_forms
    assert not found.forms
    end = extend(rows, start, [found.candidate])
    wider, alone = (
        final_estimates(rows, end, asked.significance, [x], systematic=True).parameters[0]
        for x in (found, replace(found, near_forms=()))
    )
    apart = max(abs(float(f.values[0] / found.score.values[0]) - 1) for f in found.near_forms)
    value, less = wider["extra_friction"], alone["extra_friction"]
    assert value.sd == pytest.approx(np.hypot(less.sd, apart * value.value / np.sqrt(3)), rel=0.1)
    assert value.sd > 2.0 * less.sd


@term
def while_driving(t, q, qd, load, joint, settings, resistance, level):
    if load[joint] * qd[joint] > 0.0:
        level[joint] += settings[0] * abs(load[joint])


@pytest.mark.parametrize("other", ["whole load", "gravity load"])
def test_friction_that_grows_with_the_load_is_as_large_in_another_form(other):
    """What driving has more than braking looks like a torque gain, so that the form stays open."""
    arm = wam(Term(while_driving, JOINT, (2 * SHARE,)))
    rows, nominal = nominal_of(source_of(recorded(arm, 1)))
    effect = catalogue()["load_dependent_friction"]
    for form, least in ("load while driving", 0.99), (other, 0.8):
        end = extend(rows, nominal, [effect.at((JOINT,), variant=form)])
        values = final_estimates(rows, end, Significance()).parameters[0]
        assert least * SHARE < values["coefficient"].value < SHARE / least
