"""The compiled chain against the rigid-body library."""

import numpy as np
import pinocchio as pin
import pytest

from ident.dynamics.compiled_chain import chain_of, weights
from wamctl.arm.config import find_file
from wamctl.arm.robot import cad_parameters, load_robot


def arms():
    """The WAM, and the same with a joint that slides."""
    urdf = find_file("wam7.urdf").read_text()
    name = load_robot(urdf).joint_names[3]
    slides = urdf.replace(
        f'<joint name="{name}" type="revolute"', f'<joint name="{name}" type="prismatic"'
    )
    return [load_robot(urdf), load_robot(slides)]


@pytest.mark.parametrize("slides", [False, True], ids=["turning", "sliding"])
def test_the_weight_of_the_links_along_any_direction(slides):
    robot = arms()[slides]
    assert robot.sliding.any() == slides
    q = np.random.default_rng(2).normal(size=(5, robot.dof))
    along = weights(chain_of(robot), cad_parameters(robot), q)
    data = robot.model.createData()
    for gravity in ([0.0, 0.0, -9.81], [1.0, -2.0, 3.0]):
        robot.model.gravity.linear = np.array(gravity)
        held = [pin.computeGeneralizedGravity(robot.model, data, x).copy() for x in q]
        np.testing.assert_allclose(along @ gravity, held, atol=1e-9)
