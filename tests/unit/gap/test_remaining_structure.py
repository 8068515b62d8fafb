"""Structure that no effect explains is told with the variable that it depends on, and how often."""

import numpy as np
import pytest
from closed_loop import nominal_of, recorded, source_of, wam

from ident.gap.lack_of_fit.remaining_structure import remaining_structures
from ident.gap.settings import LackOfFit
from ident.simulation.arm import Term, term


@term
def pump(t, q, qd, load, joint, settings, resistance, level):
    """Torque that comes again in time, whatever the arm does."""
    resistance[joint] += settings[0] * np.sin(2 * np.pi * 1.3 * t)


@term
def ridges(t, q, qd, load, joint, settings, resistance, level):
    """Torque that comes again with the joint's angle, twenty times a radian."""
    resistance[joint] += settings[0] * np.sin(20.0 * q[joint])


@pytest.mark.parametrize(
    ("hidden", "depends_on"),
    [
        (Term(pump, 2, (0.3,)), "time, periodically, at about 1.3 Hz"),
        (Term(ridges, 2, (0.3,)), "the angle of joint 3, periodically, about every 0.31 rad"),
    ],
    ids=["time", "angle"],
)
def test_what_comes_again_is_told_with_how_often(hidden: Term, depends_on: str) -> None:
    rows, nominal = nominal_of(source_of(recorded(wam(hidden))))
    first = remaining_structures(rows, nominal, LackOfFit())[0]
    assert (first.joint, first.group) == (2, depends_on)
