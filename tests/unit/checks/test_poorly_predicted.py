"""A joint of whose torque a model explains less than half is told, with its size."""

import numpy as np

from ident.checks.remark import Grade
from ident.checks.settings import DEFAULT
from ident.checks.torque import poorly_predicted

NAMES = ("arm/first_joint", "arm/second_joint", "arm/held_joint")


def told(shares):
    rms = np.array([0.5, 0.02, np.nan])
    return poorly_predicted(np.array(shares), rms, NAMES, ["N m"] * 3, DEFAULT)


def test_a_light_joint_is_told_with_its_torque_and_the_error():
    (remark,) = told([0.1, 2.5, np.nan])
    assert remark.code == "large_error"
    assert remark.joints == (2,)
    assert remark.grade is Grade.DOUBTFUL
    assert "250 % at joint 2" in remark.finding
    assert "0.02 N m, where the torque itself has 0.008 N m; rms" in remark.finding


def test_less_than_half_of_the_mean_square_is_little():
    (remark,) = told([0.1, 0.72, np.nan])
    assert "72 % at joint 2" in remark.finding


def test_the_other_joints_figures_hold_beside_a_light_one_alone():
    names, units = [f"j{k}" for k in range(4)], 4 * ["N m"]

    def advice(shares, torque):
        shares = np.array(shares)
        (remark,) = poorly_predicted(shares, shares * torque, names, units, DEFAULT)
        return remark.advice

    light, still = advice([0.1, 0.1, 0.2, 2.5], [9, 9, 2, 0.1]), "the other joints still hold"
    assert still in light
    for wrong in (
        advice([9.0, 2.0, 2.5, 0.1], [9, 9, 2, 9]),
        advice([0.1, 0.1, 0.2, 2.5], [9, 9, 2, 99]),
    ):
        assert still not in wrong
        assert wrong.startswith("Check the unit, the sign and the place of each joint's torque")


def test_joints_that_the_model_explains_are_not_told():
    assert told([0.1, 0.69, np.nan]) == []
