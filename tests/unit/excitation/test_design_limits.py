"""Designs under good, bad and impossible limits."""

from dataclasses import replace

import numpy as np
import pytest

from ident.excitation.design import DesignTask, accepted, problem_of
from ident.excitation.optimisation.scale_into_limits import fit
from ident.excitation.problem.arm_limits import design_limits, faults_at, possible_pose
from ident.excitation.problem.constraints import constraints_of
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.trajectory_grid import coefficients_of, grid, series_of
from ident.excitation.settings import DesignSettings
from wamctl.arm.collision import collision_shapes
from wamctl.arm.config import ArmFile
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.trajectory import FourierSeries
from wamctl.arm.trajectory_check import check_trajectory, violations
from wamctl.arm.transmission import transmission


def tightened(place: DesignTask, rng: np.random.Generator) -> DesignTask:
    """The same arm under limits that are smaller by random factors."""
    old = place.limits
    names = ("velocity_rad_s", "acceleration_rad_s2", "jerk_rad_s3")
    new: dict[str, object] = {
        name: tuple(np.array(getattr(old, name)) * 10 ** rng.uniform(-2, 0, 7)) for name in names
    }
    new["elbow_speed_m_s"] = old.elbow_speed_m_s * 10 ** rng.uniform(-1.5, 0)
    new["tool_speed_m_s"] = old.tool_speed_m_s * 10 ** rng.uniform(-1.5, 0)
    new["clearance_m"] = rng.uniform(0.0, 0.06)
    limits = old.model_copy(update=new)
    arm_limits = place.arm.limits.model_copy(update=new)
    arm = place.arm.model_copy(update={"limits": arm_limits})
    return replace(place, arm=arm, limits=limits)


@pytest.mark.parametrize("seed", range(4))
def test_however_bad_the_limits_they_are_kept(
    place: DesignTask, problem: Problem, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    under = tightened(place, rng)
    constraints = constraints_of(under.arm, under.robot, under.limits)
    wild = 5 * rng.normal(size=(11, 7))
    wild[-1] = possible_pose(under.arm, under.robot, under.limits, "test")
    fitted = fit(replace(problem, constraints=constraints), wild)
    if fitted is None:
        pytest.skip("this random centre is not allowed; the search tries others")
    series = series_of(fitted, place.robot.joint_names, 0.1 * np.pi)
    found = accepted(under, problem.columns, series, 3)
    assert check_trajectory(under.arm, under.robot, found.trajectory) == []
    assert [s for q in found.quantities for s in violations(q, found.t)] == []


def excitation(arm: ArmFile, **values: object) -> ArmFile:
    return arm.model_copy(update={"excitation": arm.excitation.model_copy(update=values)})


def test_an_empty_range_is_named(place: DesignTask) -> None:
    arm = excitation(place.arm, position_lower_rad=(-1.0,) * 6 + (2.1,))
    with pytest.raises(ConfigurationError) as caught:
        design_limits(arm, "arm.yaml")
    assert str(caught.value) == (
        "arm.yaml: excitation: the position range of joint 7 is empty, 2.1 to 2.1 rad, once the "
        "tighter of the excitation's and the arm's limits is taken."
    )


def test_too_little_torque_to_hold_the_arm_is_named(place: DesignTask) -> None:
    limits = place.limits.model_copy(update={"motor_torque_nm": (0.01,) * 7})
    with pytest.raises(ConfigurationError, match=r"no pose was found .* torque of motor 1 is "):
        possible_pose(place.arm, place.robot, limits, "arm.yaml")


def test_too_much_clearance_is_named(place: DesignTask) -> None:
    limits = place.limits.model_copy(update={"clearance_m": 5.0})
    with pytest.raises(ConfigurationError, match=r"distance of pedestal and upper arm is "):
        possible_pose(place.arm, place.robot, limits, "arm.yaml")


def test_elbow_and_tool_may_be_asked_to_be_slower(place: DesignTask) -> None:
    slow = design_limits(excitation(place.arm, speed_m_s=0.45), "arm.yaml")
    assert (slow.elbow_speed_m_s, slow.tool_speed_m_s) == (0.45, 0.45)
    usual, faster = (
        design_limits(excitation(place.arm, speed_m_s=v), "arm.yaml") for v in (None, 7.0)
    )
    assert faster.tool_speed_m_s == usual.tool_speed_m_s
    assert usual.tool_speed_m_s > 0.8


def test_friction_behind_a_differential_counts_in_its_hardest_directions(place: DesignTask) -> None:
    """Motors 5 and 6 feel the friction of joints 5 and 6 at once, whichever way those turn."""
    coulomb = np.array(place.arm.excitation.expected_coulomb_nm)
    shared = float(np.abs(joint_from_motor(place)[:, 4]) @ coulomb)
    bound = (*place.limits.motor_torque_nm[:4], 0.9 * shared, *place.limits.motor_torque_nm[5:])
    limits = place.limits.model_copy(update={"motor_torque_nm": bound})
    shapes = collision_shapes(place.robot)
    still = possible_pose(place.arm, place.robot, place.limits, "arm.yaml")
    (found,) = faults_at(place.arm, place.robot, limits, shapes, still)
    assert found.startswith("torque of motor 5 is ")


def joint_from_motor(place: DesignTask) -> np.ndarray:
    return transmission(place.arm.transmission, place.arm.arm).joint_from_motor


def test_rates_hold_over_the_ramps_and_between_the_samples(place: DesignTask) -> None:
    """A short ramp and a joint's jerk close to its bound."""
    arm = excitation(place.arm, ramp_s=0.05)
    a, b = np.full((2, 7, 5), 0.05)
    series = FourierSeries(
        place.robot.joint_names, 0.1 * np.pi, a, b, np.array([0, 0, 0, 1, 0, 0, 0])
    )
    tight = place.limits.model_copy(update={"jerk_rad_s3": (0.02,) * 7})
    under = replace(place, arm=arm, limits=tight)
    columns = problem_of(under, DesignSettings()).columns
    found = accepted(under, columns, series, 3).trajectory
    assert check_trajectory(arm, place.robot, found) == []
    fine = grid(0.1 * np.pi, 5, 1_000_003)
    jerk = np.abs(fine.jerk @ coefficients_of(found.series)).max(axis=0)
    assert (jerk <= 0.02).all()
