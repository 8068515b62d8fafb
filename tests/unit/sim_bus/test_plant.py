"""The physics against arms derived by hand."""

import numpy as np
import pytest
from pendulum import A1, C1, C2, I1, I2, M1, M2, G, pendulum
from scipy.integrate import solve_ivp

from sim_bus.plant.physics import Physics, plain_physics
from sim_bus.plant.plant import EndStops, Plant
from sim_bus.plant.truth import Truth
from wamctl.arm.robot import Robot, cad_parameters, load_robot

STEP_NS = 250_000

PENDULUM = pendulum(reach=9.0, speed=50.0)

# A wheel on a vertical axis: inertia alone.
WHEEL_INERTIA = 0.25
WHEEL = f"""<robot name="wheel">
  <link name="base"/>
  <joint name="hub" type="revolute"><parent link="base"/><child link="rim"/>
    <axis xyz="0 0 1"/><limit lower="-9" upper="9" velocity="50" effort="50"/></joint>
  <link name="rim"><inertial><mass value="1"/>
    <inertia ixx="0.2" iyy="0.2" izz="{WHEEL_INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""


def physics(robot: Robot, **changes) -> Physics:
    n = robot.dof
    facts = {
        "viscous": np.zeros(n),
        "coulomb": np.zeros(n),
        "rotor_inertia": np.zeros(n),
        "motor_from_joint": np.eye(n),
    } | {name: np.array(value, dtype=float) for name, value in changes.items()}
    truth = Truth(names=robot.inertial_names, delta=cad_parameters(robot), seed=0, **facts)
    return plain_physics(truth, np.array([0.0, 0.0, -G]))


def plant(urdf: str, q: list[float], **changes) -> Plant:
    robot = load_robot(urdf)
    n = len(q)
    stops = EndStops(np.full(n, -9.0), np.full(n, 9.0), np.full(n, 1e3), np.full(n, 10.0))
    return Plant(robot, physics(robot, **changes), stops, np.array(q), STEP_NS)


def run(arm: Plant, seconds: float, torque: list[float]) -> None:
    n = len(torque)
    arm.advance(arm.time_ns + round(seconds * 1e9), np.array(torque), np.zeros(n))


def mass_and_bias(q, qd):
    h = M2 * A1 * C2
    m11 = I1 + I2 + M1 * C1**2 + M2 * (A1**2 + C2**2) + 2 * h * np.cos(q[1])
    m12 = I2 + M2 * C2**2 + h * np.cos(q[1])
    m22 = I2 + M2 * C2**2
    pull = M2 * G * C2 * np.sin(q[0] + q[1])
    coriolis = h * np.sin(q[1])
    bias = [
        -coriolis * (2 * qd[0] * qd[1] + qd[1] ** 2)
        + (M1 * C1 + M2 * A1) * G * np.sin(q[0])
        + pull,
        coriolis * qd[0] ** 2 + pull,
    ]
    return np.array([[m11, m12], [m12, m22]]), np.array(bias)


def energy(q, qd):
    mass, _ = mass_and_bias(q, qd)
    height = -(M1 * C1 + M2 * A1) * np.cos(q[0]) - M2 * C2 * np.cos(q[0] + q[1])
    return 0.5 * qd @ mass @ qd + G * height


def test_a_double_pendulum_moves_as_derived_by_hand():
    viscous, torque = np.array([0.3, 0.1]), np.array([0.5, -0.2])

    def rates(_, x):
        mass, bias = mass_and_bias(x[:2], x[2:])
        return [*x[2:], *np.linalg.solve(mass, torque - bias - viscous * x[2:])]

    exact = solve_ivp(rates, (0, 2), [1.0, -0.5, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    arm = plant(PENDULUM, [1.0, -0.5], viscous=viscous)
    run(arm, 2.0, [0.5, -0.2])
    np.testing.assert_allclose([*arm.q, *arm.qd], exact, atol=1e-5)


def test_no_friction_keeps_the_energy():
    arm = plant(PENDULUM, [1.0, -0.5])
    before = energy(arm.q, arm.qd)
    run(arm, 10.0, [0.0, 0.0])
    assert abs(energy(arm.q, arm.qd) - before) < 1e-4


def test_friction_below_its_bound_holds_still():
    arm = plant(WHEEL, [0.3], coulomb=[0.8])
    run(arm, 1.0, [0.79])
    assert arm.q[0] == 0.3
    assert arm.qd[0] == 0.0


def test_friction_above_its_bound_gives_way():
    arm = plant(WHEEL, [0.3], coulomb=[0.8])
    run(arm, 1.0, [0.9])
    assert arm.qd[0] == pytest.approx(0.1 / WHEEL_INERTIA, rel=1e-9)
    assert arm.q[0] == pytest.approx(0.3 + 0.5 * 0.1 / WHEEL_INERTIA, rel=1e-6)


def test_a_wheel_slides_to_rest_and_stays():
    arm = plant(WHEEL, [0.0], coulomb=[0.5])
    run(arm, 0.5, [1.5])
    speed, start = arm.qd[0], arm.q[0]
    run(arm, 5.0, [0.0])
    assert arm.qd[0] == 0.0
    assert arm.q[0] - start == pytest.approx(speed**2 / (2 * 0.5 / WHEEL_INERTIA), rel=1e-4)


def test_a_pendulum_leans_on_its_friction():
    arm = plant(PENDULUM, [0.05, 0.0], coulomb=[3.0, 0.01])
    run(arm, 1.0, [0.0, 0.0])
    assert arm.q[0] == 0.05
    assert arm.q[1] != 0.0
    arm = plant(PENDULUM, [0.05, 0.0], coulomb=[3.0, 3.0])
    run(arm, 1.0, [0.0, 0.0])
    np.testing.assert_array_equal(arm.q, [0.05, 0.0])


def test_a_rotor_adds_its_inertia_by_the_square_of_the_ratio():
    arm = plant(WHEEL, [0.0], rotor_inertia=[1e-3], motor_from_joint=[[-10.0]])
    run(arm, 1.0, [-0.2])
    assert arm.qd[0] == pytest.approx(2.0 / (WHEEL_INERTIA + 0.1), rel=1e-9)


def test_a_disabled_motor_brakes():
    arm = plant(WHEEL, [0.0], motor_from_joint=[[10.0]])
    run(arm, 1.0, [0.1])
    speed = arm.qd[0]
    drag = np.array([2e-3])
    arm.advance(arm.time_ns + 10**9, np.zeros(1), drag)
    assert arm.qd[0] == pytest.approx(speed * np.exp(-0.2 / WHEEL_INERTIA), rel=1e-4)


def test_an_end_stop_holds_the_arm():
    robot = load_robot(WHEEL)
    stops = EndStops(np.array([-1.0]), np.array([1.0]), np.array([500.0]), np.array([20.0]))
    arm = Plant(robot, physics(robot), stops, np.array([0.0]), STEP_NS)
    run(arm, 3.0, [5.0])
    assert arm.q[0] == pytest.approx(1.0 + 5.0 / 500.0, abs=1e-4)


def test_a_locked_arm_does_not_fall():
    arm = plant(PENDULUM, [1.0, 0.0])
    arm.hold()
    run(arm, 1.0, [0.0, 0.0])
    np.testing.assert_array_equal(arm.q, [1.0, 0.0])
    assert arm.time_ns == 10**9


def test_a_warm_up_leaves_no_trace():
    arm = plant(PENDULUM, [1.0, 0.0], coulomb=[0.1, 0.1])
    arm.warm_up()
    np.testing.assert_array_equal(arm.q, [1.0, 0.0])
    np.testing.assert_array_equal(arm.qd, [0.0, 0.0])
