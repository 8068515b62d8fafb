"""A fault is believed only where its own joints, and the torque that was fitted, bear it out."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from ident.checks import hypotheses
from ident.checks.case import Case
from ident.checks.conditioning import tells_too_little
from ident.checks.settings import DEFAULT
from ident.checks.torque import unexplained


def case(error, by_joint, fitted=None):
    """A case of these errors, of torque that was not fitted, and that was."""
    fitted = error / 4 if fitted is None else fitted
    found = SimpleNamespace(error=error, by_joint=np.array(by_joint), fitted=fitted)
    found.fitted_by_joint = np.full(len(by_joint), fitted)
    found.robot = SimpleNamespace(joint_names="abcd")
    found.better_by = partial(Case.better_by, found)
    return found


CHANCE = (0.93, 0.06, 0.14, 0.06)
"""Joint 1 is poorly shown, and by chance better with joints 2 and 4 exchanged."""

NOISE = (0.17, 0.09, 0.23, 0.99)
"""Joint 4 shows noise, and would be given the weight that joint 2 holds."""


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (CHANCE, (0.2, 0.3, 0.1, 0.3), 0),
        (CHANCE, (0.2, 0.03, 0.1, 0.04), 1),
        (NOISE, (0.17, 0.43, 0.2, 0.2), 0),
        (NOISE, (0.17, 0.08, 0.2, 0.2), 1),
    ],
)
def test_a_swap_that_its_own_joints_speak_against_is_none(monkeypatch, before, after, told):
    before = case(0.4, before)
    swap = next(hypotheses._exchanges((1, 3), np.array([0, 3, 2, 1]), "joints 2 and 4", "swapped"))
    found = [(swap, case(0.24, after)), (swap, case(0.24, after))]
    monkeypatch.setattr(hypotheses, "_hypotheses", lambda _: [])
    monkeypatch.setattr(hypotheses, "nearest", lambda *_: found.pop(0))
    monkeypatch.setattr(hypotheses, "_weighed", lambda *_: before)
    assert len(hypotheses.scanned(before, DEFAULT)[2]) == told


@pytest.mark.parametrize(("fitted", "told"), [(0.12, 0), (0.05, 1)])
def test_what_only_a_poor_motion_bears_out_is_no_fault(monkeypatch, fitted, told):
    """The error on other torque falls to 58 %, but what is fitted is explained no better."""
    before = case(0.44, (1.14, 0.06, 0.12, 0.26), fitted=0.12)
    swap = next(hypotheses._exchanges((0, 3), np.array([3, 1, 2, 0]), "joints 1 and 4", "swapped"))
    after = case(0.26, (0.16, 0.06, 0.12, 0.19), fitted)
    found = [(swap, after), (swap, after)]
    monkeypatch.setattr(hypotheses, "_hypotheses", lambda _: [])
    monkeypatch.setattr(hypotheses, "nearest", lambda *_: found.pop(0))
    monkeypatch.setattr(hypotheses, "_weighed", lambda *_: before)
    assert len(hypotheses.scanned(before, DEFAULT)[2]) == told


@pytest.mark.parametrize(("fitted", "told"), [(0.1, 0), (0.97, 1)])
def test_a_joint_that_is_fitted_well_is_not_called_unexplained(fitted, told):
    """A poor motion lets the error on other torque grow; the sensor is not to blame."""
    light = SimpleNamespace(
        by_joint=np.array([1.14, 0.06]),
        fitted_by_joint=np.array([fitted, 0.03]),
        total=0.05,
        springs=False,
        robot=SimpleNamespace(joint_names="ab"),
    )
    assert len(unexplained(light, DEFAULT)) == told


@pytest.mark.parametrize(("fitted", "little"), [(0.06, True), (0.3, False)])
def test_a_motion_that_tells_too_little_is_not_blamed_on_the_urdf(fitted, little):
    """Joints that each move one way: 60 % of the torque that was not fitted are left."""
    assert tells_too_little(SimpleNamespace(error=0.6, fitted=fitted), DEFAULT) == little
