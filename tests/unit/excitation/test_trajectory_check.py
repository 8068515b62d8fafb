"""Each limit that a motion can break, by its whole sentence."""

from dataclasses import replace

import numpy as np
import pytest

from ident.dynamics.regressor import Motion
from ident.excitation.design import DesignTask, problem_of
from ident.excitation.problem.regressor_columns import exact_rows
from ident.excitation.settings import DesignSettings
from wamctl.arm.config import ArmFile, load_arm_file
from wamctl.arm.trajectory import Trajectory, read_trajectory, sample
from wamctl.arm.trajectory_check import check_trajectory


def with_limits(arm: ArmFile, **limits: object) -> ArmFile:
    return arm.model_copy(update={"limits": arm.limits.model_copy(update=limits)})


@pytest.fixture(scope="module")
def shipped() -> Trajectory:
    return read_trajectory("wam7-excitation.yaml")


def resting(shipped: Trajectory, pose: list[float]) -> Trajectory:
    series = shipped.series
    still = replace(series, a=0 * series.a, b=0 * series.b, q0=np.array(pose))
    return replace(shipped, series=still)


@pytest.mark.parametrize("config", ["wam7.yaml", "wam7-classic.yaml"])
@pytest.mark.parametrize("name", ["wam7-excitation.yaml", "wam7-excitation-balanced.yaml"])
def test_the_shipped_trajectories_may_run(place: DesignTask, config: str, name: str) -> None:
    assert check_trajectory(load_arm_file(config), place.robot, read_trajectory(name)) == []


def test_the_balanced_trajectory_keeps_its_promise_and_sees_more(
    place: DesignTask, shipped: Trajectory
) -> None:
    columns = problem_of(place, DesignSettings()).columns
    conditions, errors = [], []
    for trajectory in (shipped, read_trajectory("wam7-excitation-balanced.yaml")):
        series = trajectory.series
        t = np.linspace(0.0, series.period_s, 4000, endpoint=False)
        rows = exact_rows(columns, Motion(*sample(series, t)))
        conditions.append(np.linalg.cond(rows))
        assert trajectory.promise["condition_number"] == pytest.approx(conditions[-1], rel=1e-3)
        errors.append(np.sqrt(np.diag(np.linalg.inv(rows.T @ rows))))
    ratio = errors[1] / errors[0]
    assert conditions[1] < 0.8 * conditions[0]
    assert np.median(ratio) < 0.8
    assert np.exp(np.log(ratio).mean()) < 0.7


def test_other_joints_are_refused(place: DesignTask, shipped: Trajectory) -> None:
    series = replace(shipped.series, joint_names=("a", "b"))
    sentence = check_trajectory(place.arm, place.robot, replace(shipped, series=series))
    assert sentence == [
        "the trajectory moves the joints a, b, while the arm's are "
        + ", ".join(place.robot.joint_names)
    ]


def test_position_names_joint_value_and_bound(place: DesignTask, shipped: Trajectory) -> None:
    found = check_trajectory(
        place.arm, place.robot, resting(shipped, [0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 3.25])
    )
    assert found == [
        "position of joint 7 (palm yaw) is 3.25 rad at 0.000 s, above its limit of 3 rad"
    ]


def test_bodies_too_near_are_named(place: DesignTask, shipped: Trajectory) -> None:
    found = check_trajectory(
        place.arm, place.robot, resting(shipped, [0.0, 1.95, 0.0, 0.3, 0.0, 0.0, 0.0])
    )
    assert found
    assert all(s.startswith("distance of table and ") for s in found)
    assert all("below its limit of 0.02 m" in s for s in found)


@pytest.mark.parametrize(
    ("limit", "value", "start"),
    [
        ("velocity_rad_s", (0.3,) * 7, "velocity of joint 1 (base yaw) is "),
        ("acceleration_rad_s2", (0.3,) * 7, "acceleration of joint 1 (base yaw) is "),
        ("jerk_rad_s3", (0.3,) * 7, "jerk of joint 1 (base yaw) is "),
        ("motor_torque_nm", (0.004,) * 7, "torque of motor 1 is "),
        ("motor_torque_slew_nm_s", (1e-4,) * 7, "torque slew of motor 1 is "),
        ("elbow_speed_m_s", 0.2, "speed of elbow (wam/link4) is "),
        ("tool_speed_m_s", 0.2, "speed of tool (wam/link7_dh) is "),
        ("power_w", 20.0, "power of all motors is "),
        ("kinetic_energy_j", 1.0, "kinetic energy of the arm is "),
    ],
)
def test_every_limit_is_checked(
    place: DesignTask, shipped: Trajectory, limit: str, value: object, start: str
) -> None:
    arm = with_limits(place.arm, **{limit: value})
    assert check_trajectory(arm, place.robot, shipped)[0].startswith(start)
