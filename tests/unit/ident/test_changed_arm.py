"""Models of an arm to which something known has been done, beside Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from ident.dynamics.parameters import Terms
from ident.model.fit_filter import Filter
from ident.model.identified_model import Model
from ident.planning.changed_arm import changed
from tests.pendulum import pendulum
from wamctl.arm.configuration.known_change import known_change
from wamctl.arm.robot import cad_parameters, load_robot


@pytest.fixture
def model() -> Model:
    robot = load_robot(pendulum())
    n = robot.dof
    return Model(
        arm="pendulum",
        estimator="ols",
        robot=robot,
        terms=Terms(False, False, False, False, np.eye(n), False),
        delta=cad_parameters(robot),
        moving=np.ones(n, dtype=bool),
        base_parameters=(),
        filter=Filter(5.0, 3, 20.0, 20.0, True, 0.05),
        noise=np.full(n, 0.1),
        logs=(),
    )


def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, qd, qdd = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 20, 2))
    return q, qd, qdd


def by_pinocchio(model: pin.Model) -> np.ndarray:
    data = model.createData()
    return np.array([pin.rnea(model, data, *s) for s in zip(*motion(), strict=True)])


def test_a_mass_at_the_tool(model):
    loaded = model.robot.model.copy()
    centre = np.array([0.1, -0.05, 0.2])
    loaded.inertias[2] += pin.Inertia(1.5, centre, np.zeros((3, 3)))
    found = changed(model, known_change("load=1.5,0.1,-0.05,0.2")).inverse_dynamics(*motion())
    assert found == pytest.approx(by_pinocchio(loaded), abs=1e-9)
    assert np.abs(found - model.inverse_dynamics(*motion())).max() > 0.5


def test_a_base_that_was_turned(model):
    turned = model.robot.model.copy()
    base = pin.rpy.rpyToMatrix(np.deg2rad(20.0), 0.0, 0.0) @ pin.rpy.rpyToMatrix(0.0, 0.1, 0.0)
    turned.gravity.linear = base.T @ model.robot.model.gravity.linear
    change = known_change(f"tilt=20,{np.rad2deg(0.1)}")
    found = changed(model, change).inverse_dynamics(*motion())
    assert found == pytest.approx(by_pinocchio(turned), abs=1e-9)


def test_again_is_the_same_arm(model):
    assert changed(model, known_change("again")) is model
