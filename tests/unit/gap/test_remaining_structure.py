"""Structure that no effect explains is told with the variable that it depends on, and how often."""

from types import SimpleNamespace

import numpy as np
import pytest
from closed_loop import nominal_of, recorded, source_of, wam

from ident.gap.lack_of_fit.remaining_structure import remaining_structures
from ident.gap.settings import LackOfFit
from ident.simulation.arm import Term, term
from ident.workflows.gap_json import unexplained_content


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


def test_what_the_catalogue_explains_is_told_of_that_joint_and_of_what_is_not_in_the_model():
    """A delay of all joints gains much in all, and little at one."""
    places = (0, 1), (1,)
    inside, beside = (SimpleNamespace(effect="torque_delay", joints=j, rows=j) for j in places)
    fit = SimpleNamespace(gains_over=lambda _: np.array([1.8, 0.2]))
    scores = [SimpleNamespace(candidate=h, gain=2.0, fit=fit) for h in (inside, beside)]
    left = SimpleNamespace(joint=1, gain=0.4, group="its speed", share=0.5)
    item = SimpleNamespace(structure=left, share_of_gap=0.5)
    end = SimpleNamespace(accepted=(inside,), fit=None)
    verdict = SimpleNamespace(unexplained=[item])
    found = SimpleNamespace(last_scores=scores, end=end, verdict=verdict)
    ((nearest,),) = (told["nearest"] for told in unexplained_content(found))
    assert nearest["joints"] == [2]
    assert nearest["share_of_residual"] == pytest.approx(1 - np.exp(-2 * 0.2))
