"""Stiffness of a spring where it rests, whether it hardens or not."""

import pytest
from closed_loop import nominal_of, recorded, source_of, wam

from ident.effects.catalogue import catalogue
from ident.effects.joint_spring import EFFECT
from ident.gap.regression.current_model import extend
from ident.gap.selection.estimates import final_estimates
from ident.gap.settings import Significance
from ident.simulation.arm import Term, term

JOINT, STIFFNESS, REST = 3, 2.0, 1.4  # from 0, N m/rad, rad
HARDENING = 0.2  # N m/rad^3


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
