"""The columns of what may change beside the base parameters."""

import numpy as np

from ident.dynamics.regressor import Motion
from ident.fleet.columns import ZeroColumns
from tests.pendulum import pendulum
from tests.unit.fleet.conftest import JOINTS
from wamctl.arm.robot import inverse_dynamics, load_robot


def test_zero_columns_are_the_slopes_of_the_torque():
    robot = load_robot(pendulum(), JOINTS)
    q, qd, qdd = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 20, 2))
    slopes = ZeroColumns(robot)(Motion(q, qd, qdd))
    for j in range(2):
        turn = 1e-6 * np.eye(2)[j]
        there, back = (inverse_dynamics(robot, q + s * turn, qd, qdd) for s in (1, -1))
        np.testing.assert_allclose(slopes[:, :, j], (there - back) / 2e-6, atol=1e-7)
