"""The rigid-body core against arms derived by hand and against itself."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pendulum import A1, C1, C2, I1, I2, M1, M2, G, pendulum

from wamctl.arm.config import find_file, load_arm_file
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.inertial import change_of_frame, from_pseudo_inertia, pseudo_inertia
from wamctl.arm.robot import (
    cad_parameters,
    inverse_dynamics,
    load_robot,
    regressor,
    with_parameters,
)

TWO_LINKS = pendulum()


def torque_by_hand(q, qd, qdd):
    """The textbook double pendulum, angles from hanging: L = T - V differentiated on paper."""
    m1, m2, i1, i2, a1, c1, c2, g = M1, M2, I1, I2, A1, C1, C2, G
    h = m2 * a1 * c2
    m11 = i1 + i2 + m1 * c1**2 + m2 * (a1**2 + c2**2) + 2 * h * np.cos(q[1])
    m12 = i2 + m2 * c2**2 + h * np.cos(q[1])
    m22 = i2 + m2 * c2**2
    g2 = m2 * g * c2 * np.sin(q[0] + q[1])
    g1 = (m1 * c1 + m2 * a1) * g * np.sin(q[0]) + g2
    coriolis = h * np.sin(q[1])
    return np.array(
        [
            m11 * qdd[0] + m12 * qdd[1] - coriolis * (2 * qd[0] * qd[1] + qd[1] ** 2) + g1,
            m12 * qdd[0] + m22 * qdd[1] + coriolis * qd[0] ** 2 + g2,
        ]
    )


@pytest.fixture(scope="module")
def wam():
    arm = load_arm_file("wam7.yaml")
    urdf = find_file("wam7.urdf").read_text()
    return load_robot(urdf, arm.robot.joints, arm.robot.parameter_frames)


@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6))
@settings(max_examples=50, deadline=None)
def test_a_two_joint_arm_has_the_torque_derived_by_hand(values):
    q, qd, qdd = np.array(values).reshape(3, 2)
    robot = load_robot(TWO_LINKS)
    torque = inverse_dynamics(robot, q[None], qd[None], qdd[None])[0]
    np.testing.assert_allclose(torque, torque_by_hand(q, qd, qdd), atol=1e-10)


def test_regressor_times_parameters_is_the_inverse_dynamics(wam):
    q, qd, qdd = np.random.default_rng(1).normal(size=(3, 50, 7))
    torque = inverse_dynamics(wam, q, qd, qdd)
    np.testing.assert_allclose(regressor(wam, q, qd, qdd) @ cad_parameters(wam), torque, atol=1e-11)


def test_other_parameters_change_the_dynamics_as_the_regressor_says(wam):
    rng = np.random.default_rng(2)
    delta = cad_parameters(wam) * rng.uniform(0.9, 1.1, 70)
    q, qd, qdd = rng.normal(size=(3, 20, 7))
    torque = inverse_dynamics(with_parameters(wam, delta), q, qd, qdd)
    np.testing.assert_allclose(regressor(wam, q, qd, qdd) @ delta, torque, atol=1e-11)
    np.testing.assert_allclose(cad_parameters(with_parameters(wam, delta)), delta, atol=1e-14)


def test_pseudo_inertia_moves_like_pinocchio_s_inertia():
    rng = np.random.default_rng(3)
    placement, inertia = pin.SE3.Random(), pin.Inertia.Random()
    order = [4, 5, 7, 6, 8, 9, 1, 2, 3, 0]
    here = inertia.toDynamicParameters()[order]
    there = placement.act(inertia).toDynamicParameters()[order]
    np.testing.assert_allclose(change_of_frame(placement.homogeneous) @ here, there, atol=1e-12)
    delta = rng.normal(size=10)
    np.testing.assert_allclose(from_pseudo_inertia(pseudo_inertia(delta)), delta, atol=1e-15)


def test_the_urdf_follows_the_paper_s_dh_parameters(wam):
    dh = [
        (-np.pi / 2, 0, 0),
        (np.pi / 2, 0, 0),
        (-np.pi / 2, 0.045, 0.55),
        (np.pi / 2, -0.045, 0),
        (-np.pi / 2, 0, 0.3),
        (np.pi / 2, 0, 0),
        (0, 0, 0.06),
    ]
    q = np.random.default_rng(4).uniform(-1, 1, 7)
    data = wam.data()
    pin.framesForwardKinematics(wam.model, data, q)
    expected = np.eye(4)
    for k, ((alpha, a, d), angle) in enumerate(zip(dh, q, strict=True), 1):
        ca, sa, c, s = np.cos(alpha), np.sin(alpha), np.cos(angle), np.sin(angle)
        expected = expected @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
        frame = data.oMf[wam.model.getFrameId(f"wam/link{k}_dh")].homogeneous
        np.testing.assert_allclose(frame, expected, atol=1e-14)


def test_joints_left_out_are_locked():
    robot = load_robot(TWO_LINKS, ("shoulder",))
    torque = inverse_dynamics(robot, np.array([[0.7]]), np.zeros((1, 1)), np.ones((1, 1)))[0]
    expected = torque_by_hand(np.array([0.7, 0.0]), np.zeros(2), np.array([1.0, 0.0]))[0]
    np.testing.assert_allclose(torque[0], expected, atol=1e-10)


@pytest.mark.parametrize(
    ("joints", "frames", "sentence"),
    [
        (("knee",), (), "arm.urdf: no joint named 'knee'; its joints are shoulder, elbow."),
        (
            ("elbow", "shoulder"),
            (),
            "arm.urdf: the joints along the chain are shoulder, elbow: list them in this order.",
        ),
        ((), ("upper",), "arm.urdf: 1 parameter frames for 2 joints."),
        ((), ("upper", "hand"), "arm.urdf: no frame named 'hand'."),
        (
            (),
            ("upper", "upper"),
            "arm.urdf: frame 'upper' is not fixed to the link of joint 'elbow'.",
        ),
    ],
)
def test_faults_of_the_description_are_one_sentence(joints, frames, sentence):
    with pytest.raises(ConfigurationError) as caught:
        load_robot(TWO_LINKS, joints, frames, source="arm.urdf")
    assert str(caught.value) == sentence


def test_a_broken_urdf_is_a_configuration_error(capfd):
    with pytest.raises(ConfigurationError, match=r"^arm\.urdf: not a readable URDF \("):
        load_robot("<robot", source="arm.urdf")
    capfd.readouterr()


CONTINUOUS_ELBOW = 'name="elbow" type="continuous"'


def test_a_continuous_joint_is_one_that_may_be_anywhere_on_its_circle():
    limited = load_robot(TWO_LINKS)
    spinning = load_robot(TWO_LINKS.replace('name="elbow" type="revolute"', CONTINUOUS_ELBOW))
    assert spinning.joint_names == limited.joint_names
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 5, 2))
    torque = inverse_dynamics(limited, q, qd, qdd)
    np.testing.assert_allclose(inverse_dynamics(spinning, q, qd, qdd), torque)
    elbow = spinning.joint_names.index("elbow")
    assert spinning.model.upperPositionLimit[elbow] == pytest.approx(np.pi)


def test_a_joint_of_several_degrees_of_freedom_is_refused_by_name():
    floating = TWO_LINKS.replace('name="elbow" type="revolute"', 'name="elbow" type="floating"')
    with pytest.raises(ConfigurationError, match="joint 'elbow' has more than one degree"):
        load_robot(floating, source="arm.urdf")


GRIPPER = """
  <link name="finger"/><link name="thumb"/>
  <joint name="close" type="prismatic"><parent link="lower"/><child link="finger"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.04" velocity="1" effort="9"/></joint>
  <joint name="follow" type="prismatic"><parent link="lower"/><child link="thumb"/>
    <axis xyz="-1 0 0"/><mimic joint="close"/>
    <limit lower="0" upper="0.04" velocity="1" effort="9"/></joint>
</robot>"""
WITH_GRIPPER = TWO_LINKS.replace("</robot>", GRIPPER)
LINKAGE = TWO_LINKS.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="elbow"/>', 1)


def test_a_gripper_s_fingers_are_locked():
    robot = load_robot(WITH_GRIPPER)
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.sliding.tolist() == [False, False]
    assert load_robot(WITH_GRIPPER, ("shoulder",)).joint_names == ("shoulder",)


def test_joints_that_are_locked_may_meet_a_fixed_one_with_the_name_of_its_link():
    hand = """<link name="hand"/><joint name="hand" type="fixed"><parent link="lower"/>
        <child link="hand"/></joint><link name="tip"/><joint name="tool" type="fixed">
        <parent link="hand"/><child link="tip"/></joint></robot>"""
    robot = load_robot(TWO_LINKS.replace("</robot>", hand), ("shoulder",))
    assert robot.joint_names == ("shoulder",)


def test_xacro_is_told_from_urdf(capfd):
    with pytest.raises(ConfigurationError) as caught:
        load_robot(TWO_LINKS.replace("-0.5", "${reach}"), source="arm.urdf.xacro")
    assert str(caught.value) == (
        "arm.urdf.xacro: xacro, not URDF: make one of it with `xacro FILE > arm.urdf`, and give"
        " that."
    )
    assert capfd.readouterr().err == ""
    expanded = TWO_LINKS.replace("<link", "<!-- <xacro:arm reach='${r}'/> --><link", 1)
    assert load_robot(expanded).dof == 2


@pytest.mark.parametrize("joint", ["close", "follow"])
def test_a_finger_that_is_asked_for_is_refused_by_name(joint):
    with pytest.raises(ConfigurationError) as caught:
        load_robot(WITH_GRIPPER, ("shoulder", "elbow", joint), source="arm.urdf")
    assert str(caught.value) == (
        "arm.urdf: joint 'follow' moves with 'close' (mimic): leave both out, and they are locked"
        " at zero."
    )


def test_a_linkage_in_the_chain_is_refused_by_name():
    alone = GRIPPER.replace('<mimic joint="close"/>', "")
    with pytest.raises(ConfigurationError) as caught:
        load_robot(LINKAGE.replace("</robot>", alone), source="arm.urdf")
    assert str(caught.value) == (
        "arm.urdf: joint 'shoulder' moves with 'elbow' (mimic) and carries close, follow: such a"
        " linkage is no chain of independent joints, and cannot be modelled."
    )


def test_a_gripper_alone_is_refused_by_name():
    with pytest.raises(ConfigurationError, match=r"joint 'shoulder' moves with 'elbow' \(mimic\)"):
        load_robot(LINKAGE, source="arm.urdf")


def test_a_sliding_joint_is_known():
    robot = load_robot(TWO_LINKS.replace('"elbow" type="revolute"', '"elbow" type="prismatic"'))
    assert robot.sliding.tolist() == [False, True]


def test_a_joint_with_the_name_of_a_link_may_be_left_out():
    """The SO-101's gripper is a link and a joint."""
    urdf = find_file("so101.urdf").read_text()
    names = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
    robot = load_robot(urdf, names)
    assert robot.joint_names == names
    assert robot.model.frames[robot.model.getFrameId("gripper")].type == pin.FrameType.BODY
