"""The worked examples against the real recordings and what their sources say of them."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from ident.importers.recording import mapped_recording
from wamctl.arm.config import beside, find_file, load_robot_file
from wamctl.arm.recording import Recording
from wamctl.arm.robot import Robot, load_robot

pytestmark = pytest.mark.data


def shipped_robot(name: str) -> Robot:
    section = load_robot_file(name).robot
    urdf = beside(find_file(name), section.urdf).read_text()
    return load_robot(urdf, section.joints, section.parameter_frames)


def placements(robot: Robot, q: NDArray) -> list[pin.SE3]:
    data = robot.data()
    pin.forwardKinematics(robot.model, data, q)
    return [data.oMi[k].copy() for k in range(1, robot.dof + 1)]


SUPPLIED = [
    ("xmate7p.yaml", "xmate7p/XM7p.urdf"),
    ("staubli_tx40.yaml", "staubli_tx40/tx40_mdh_modified.urdf"),
]


@pytest.mark.parametrize(("ours", "theirs"), SUPPLIED)
def test_our_urdf_moves_as_the_supplied_one(ours: str, theirs: str, real_data: Path) -> None:
    """Every joint axis goes through the same line; frames may be turned by pi about their axis."""
    robot = shipped_robot(ours)
    supplied = load_robot((real_data / theirs).read_text())
    assert supplied.dof == robot.dof
    assert [n.replace("_", "") for n in supplied.joint_names] == [
        n.replace("_", "") for n in robot.joint_names
    ]
    np.testing.assert_allclose(robot.model.lowerPositionLimit, supplied.model.lowerPositionLimit)
    np.testing.assert_allclose(robot.model.upperPositionLimit, supplied.model.upperPositionLimit)
    np.testing.assert_allclose(robot.model.effortLimit, supplied.model.effortLimit)
    np.testing.assert_allclose(robot.model.velocityLimit, supplied.model.velocityLimit)
    for q in np.random.default_rng(5).uniform(-2, 2, size=(50, robot.dof)):
        for one, other in zip(placements(robot, q), placements(supplied, q), strict=True):
            np.testing.assert_allclose(one.translation, other.translation, atol=2e-5)
            turn = one.rotation.T @ other.rotation
            np.testing.assert_allclose(np.abs(turn), np.eye(3), atol=5e-5)
            assert turn[2, 2] > 0


def test_xmate7p_columns(real_data: Path) -> None:
    source = real_data / "xmate7p" / "traj2_1per_50Hz.csv"
    recording = mapped_recording(source, "xmate7p-map.yaml")
    raw = np.loadtxt(source, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(recording.q, raw[:, :7])
    np.testing.assert_array_equal(recording.qd, raw[:, 7:14])
    np.testing.assert_array_equal(recording.effort, raw[:, 21:])
    assert recording.stamp_ns[-1] == 20_000_000_000
    estimated = np.gradient(recording.q, 0.02, axis=0)[200:-200]
    assert correlation(estimated, recording.qd[200:-200]).min() > 0.99


def test_wam_joints_are_ours(real_data: Path) -> None:
    """The arm's own gravity model follows our CAD model's, in joints 2 and 4 that move."""
    source = real_data / "barrett_wam7_2dof" / "state_and_gravity_250Hz.csv"
    recording = mapped_recording(source, "barrett_wam7_2dof-map.yaml")
    robot = shipped_robot("wam7.yaml")
    theirs = np.loadtxt(source, delimiter=",", skiprows=2)[:, 22:]
    data = robot.data()
    ours = np.array([pin.computeGeneralizedGravity(robot.model, data, q) for q in recording.q])
    assert len(ours) == len(theirs) == 2500
    assert correlation(ours, theirs)[[1, 3]].min() > 0.999
    assert set(np.flatnonzero(np.ptp(recording.q, axis=0) > 0.1)) == {1, 3}


def test_tx40_joints_move_and_dissipate(real_data: Path) -> None:
    """Friction dominates this recording, so joint torque has the sign of joint velocity."""
    source = real_data / "staubli_tx40" / "motor_position_rad_5kHz.csv"
    recording = mapped_recording(source, "staubli_tx40-map.yaml")
    lower, upper = shipped_robot("staubli_tx40.yaml").model.lowerPositionLimit, 4.8
    assert np.all(recording.q > lower - 0.05)
    assert np.all(recording.q < upper)
    velocity = np.gradient(recording.q[::50], 0.01, axis=0)
    np.testing.assert_allclose(np.abs(velocity).max(axis=0), [5, 5, 8, 11, 8, 11], rtol=0.4)
    power = np.sum(velocity * torque(recording)[::50], axis=0)
    assert np.all(power > 0)


def test_tx40_wrist_is_coupled(real_data: Path) -> None:
    """Motor 6 turns with joints 5 and 6 together: 32 (q5 + q6)."""
    folder = real_data / "staubli_tx40"
    source = folder / "motor_position_rad_5kHz.csv"
    recording = mapped_recording(source, "staubli_tx40-map.yaml")
    motors = np.loadtxt(source, delimiter=",", skiprows=1)
    np.testing.assert_allclose(32 * (recording.q[:, 4] + recording.q[:, 5]), motors[:, 5])
    np.testing.assert_allclose(recording.q[:, 1] + np.pi / 2, motors[:, 1] / 32, atol=1e-12)
    np.testing.assert_allclose(recording.q[:, 2] - np.pi / 2, motors[:, 2] / 45, atol=1e-12)
    motor_torque = np.loadtxt(folder / "motor_torque_Nm_5kHz.csv", delimiter=",", skiprows=1)
    expected = 45 * motor_torque[:, 4] + 32 * motor_torque[:, 5]
    np.testing.assert_allclose(torque(recording)[:, 4], expected)
    np.testing.assert_allclose(torque(recording)[:, 3], -48 * motor_torque[:, 3])


def torque(recording: Recording) -> NDArray:
    assert recording.effort is not None
    return recording.effort


def correlation(one: NDArray, other: NDArray) -> NDArray:
    pairs = zip(one.T, other.T, strict=True)
    return np.array([np.corrcoef(a, b)[0, 1] if np.ptp(b) else 1.0 for a, b in pairs])
