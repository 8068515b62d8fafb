"""Torques that hold the arm tell a motor's scale from a tool and from the CAD's own error."""

import numpy as np
import pinocchio as pin
import pytest

from wamctl.experiment.preflight import load_arm
from wamctl.safety.held_weight import explanation
from wamctl.safety.motor_response import ANY_SCALE

REST = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
START = np.array([0.9, 0.95, -0.3, 1.3, -2.6, 0.6, 1.9])
FRICTION = np.array([0.06, 0.09, 0.09, 0.06, 0.04, 0.04, 0.01])


@pytest.fixture(scope="module")
def arm():
    return load_arm("wam7.yaml")[1]


def held(arm, seed=None, tool_kg=0.0, pose=REST):
    """Weight on the motors of an arm whose links differ from CAD, with a tool."""
    model = pin.Model(arm.robot.model)
    if seed is not None:
        random = np.random.default_rng(seed)
        for k in range(1, model.njoints):
            model.inertias[k].mass *= 1.0 + 0.08 * random.standard_normal()
            model.inertias[k].lever = model.inertias[k].lever * (
                1.0 + 0.08 * random.standard_normal(3)
            )
    tool = pin.Inertia.FromSphere(tool_kg or 1e-9, 0.03)
    frame = model.frames[model.getFrameId(arm.file.limits.tool_frame)]
    place = frame.placement * pin.SE3(np.eye(3), np.array([0.01, 0.0, 0.06]))
    model.appendBodyToJoint(frame.parentJoint, tool, place)
    weight = pin.computeGeneralizedGravity(model, model.createData(), pose)
    return arm.transmission.joint_from_motor.T @ weight


def explained(arm, *torques):
    """In the resting pose, and in a second one."""
    tool, poses = arm.file.limits.tool_frame, np.array([REST, START])[: len(torques)]
    return explanation(arm.robot, arm.transmission, tool, poses, np.array(torques), FRICTION)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("tool_kg", [0.0, 1.0, 6.0])
def test_an_arm_near_its_model_is_no_fault_whatever_tool_it_has(arm, seed, tool_kg):
    found = explained(arm, held(arm, seed, tool_kg))
    assert found.fault(ANY_SCALE) is None
    assert found.load_kg == pytest.approx(tool_kg, abs=0.5)


@pytest.mark.parametrize(("motor", "scale"), [(1, 0.7), (2, 1.4), (3, 1.5)])
def test_a_scale_that_no_tool_explains_is_told(arm, motor, scale):
    torques = held(arm)
    torques[motor] /= scale
    found = explained(arm, torques)
    assert (found.motor, found.scale) == (motor, pytest.approx(scale, rel=0.05))
    assert found.fault((scale, scale)) == (
        f"motor {motor + 1} gives {found.scale:.2f} times the torque that it is told to give, by "
        "the weight that it holds, and no tool would explain it: look at its ratio, its torque "
        "constant, and what else pulls at its joint"
    )


def test_a_weak_elbow_may_be_a_tool(arm):
    torques = held(arm)
    torques[3] /= 0.8
    assert explained(arm, torques).fault(ANY_SCALE) is None
    assert explained(arm, torques).load_kg > 0.2


def test_a_motor_without_torque_is_left_to_its_motion(arm):
    torques = held(arm)
    torques[1] = 0.0
    assert explained(arm, torques).fault(ANY_SCALE) is None


def test_what_pulls_at_a_joint_is_no_wrong_scale(arm):
    torques = held(arm)
    torques[3] -= 0.4
    found = explained(arm, torques)
    assert found.motor == 3
    assert found.scale < 0.0
    assert found.fault((0.7, 0.9)) is None
    assert found.fault(ANY_SCALE) is None


@pytest.mark.parametrize("scale", [0.7, 1.5])
def test_in_one_pose_a_scale_is_told_only_where_the_motion_shows_one_too(arm, scale):
    torques = held(arm)
    torques[2] /= scale
    found = explained(arm, torques)
    assert found.fault((0.9 * scale, scale)) is not None
    assert found.fault((0.9 * min(1.0, scale), 1.1 * max(1.0, scale))) is None
    again = held(arm, pose=START)
    again[2] /= scale
    found = explained(arm, torques, again)
    assert found.fault((0.9 * min(1.0, scale), 1.1 * max(1.0, scale))) is not None


@pytest.mark.parametrize("pulls_nm", [(0.1, -0.09), (-0.1, 0.09)])
def test_a_hose_that_pulls_at_the_elbow_is_no_wrong_scale(arm, pulls_nm):
    """What it changes in two poses is no one factor."""
    torques = held(arm), held(arm, pose=START)
    for torque, pull_nm in zip(torques, pulls_nm, strict=True):
        torque[3] += pull_nm
    found = explained(arm, *torques)
    assert found.motor == 3
    assert found.distance > 3.3
    assert not 1.0 / 1.3 < found.scale < 1.3
    assert found.fault((0.5, 2.0)) is None
