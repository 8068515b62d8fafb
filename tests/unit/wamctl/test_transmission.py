"""Motors and joints."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wamctl.arm.config import TransmissionSection, load_arm_file
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.transmission import transmission

WAM = transmission(load_arm_file("wam7.yaml").transmission, "wam7.yaml")
SEVEN = arrays(float, 7, elements=st.floats(-10, 10))


def test_the_differentials_mix_two_joints():
    theta = WAM.motor_angle(np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]))
    assert theta == pytest.approx(
        [
            -42.0 * 0.1,
            28.25 * 0.2 - 16.8155 * 0.3,
            -28.25 * 0.2 - 16.8155 * 0.3,
            -18.0 * 0.4,
            9.7 * 0.5 - 9.7 * 0.6,
            9.7 * 0.5 + 9.7 * 0.6,
            -14.93 * 0.7,
        ]
    )


@given(SEVEN)
def test_there_and_back(q):
    assert WAM.joint_angle(WAM.motor_angle(q)) == pytest.approx(q, abs=1e-9)
    assert WAM.joint_torque(WAM.motor_torque(q)) == pytest.approx(q, abs=1e-9)


@given(SEVEN, SEVEN)
def test_no_power_is_lost(qd, tau):
    power = WAM.motor_torque(tau) @ WAM.motor_angle(qd)
    assert power == pytest.approx(tau @ qd, abs=1e-8)


def test_a_joint_without_a_motor_is_refused():
    section = TransmissionSection(
        motor_from_joint=((1.0, 2.0), (2.0, 4.0)), rotor_inertia_kg_m2=(0.0, 0.0)
    )
    with pytest.raises(ConfigurationError) as error:
        transmission(section, "arm.yaml")
    assert str(error.value).startswith(
        "arm.yaml: transmission.motor_from_joint: the matrix cannot be inverted (condition number"
    )
    assert str(error.value).endswith("so that some joint has no motor of its own.")
