"""Hidden effects: each by its formula, and all of them in the simulated WAM."""

from typing import get_args

import numpy as np
import pytest

from sim_bus.assembly import load_simulation
from sim_bus.hidden_effects.catalogue import Known, OutsideCatalogue, hidden, read_hidden_file
from sim_bus.plant.physics import StepState, plain_physics
from sim_bus.plant.plant import EndStops, Plant
from sim_bus.plant.truth import Truth, draw_truth
from wamctl.arm.config import find_file, load_arm_file
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import load_robot

H = 2.5e-4
COULOMB, VISCOUS = np.array([2.0, 1.0]), np.array([0.5, 0.2])
RATIOS = np.array([[10.0, 4.0], [-10.0, 4.0]])

ALL = [
    {"effect": "torque_offset", "joints": [2], "nm": 1.5},
    {"effect": "torque_offset", "form": "asymmetric_coulomb", "joints": [2], "nm": 0.5},
    {"effect": "stribeck", "joints": [1, 2], "extra_nm": [1.0, 2.0], "speed_rad_s": 0.1},
    {"effect": "presliding", "joints": [2], "stiffness_nm_rad": 800},
    {
        "effect": "presliding",
        "form": "lugre",
        "joints": [2],
        "stiffness_nm_rad": 800,
        "damping_nm_s_rad": 2,
        "extra_nm": 0.4,
    },
    {"effect": "nonlinear_viscous", "joints": [2], "quadratic_nm_s2_rad2": 8},
    {"effect": "asymmetric_viscous", "joints": [2], "nm_s_rad": 2},
    {"effect": "load_dependent_friction", "joints": [2], "share": 0.3},
    {"effect": "coupled_friction", "joints": [2, 3], "coulomb_nm": 0.05},
    {"effect": "thermal_drift", "joints": [2], "share": 2, "time_constant_s": 5},
    {"effect": "rotor_inertia", "joints": [2], "kg_m2": 1},
    {"effect": "coupled_inertia", "joints": [2, 3], "kg_m2": 1e-3},
    {"effect": "payload", "kg": 2},
    {"effect": "gravity_tilt", "x_rad": 0.1},
    {"effect": "encoder_offset", "joints": [2], "rad": 0.1},
    {"effect": "joint_spring", "joints": [2], "nm_rad": 10},
    {"effect": "torque_gain", "joints": [2, 3], "factor": 0.8},
    {"effect": "torque_delay", "joints": [2], "seconds": 0.01},
    {"effect": "torque_delay", "form": "lag", "joints": [2], "seconds": 0.01},
    {"effect": "torque_ripple", "joints": [2], "nm": 0.1},
    {"effect": "torque_saturation", "joints": [2, 3], "nm": 0.3},
    {"effect": "joint_elasticity", "joints": [2], "nm_rad": 500},
    {"effect": "backlash", "joints": [2], "rad": 0.02},
    {"effect": "contact", "joints": [2], "nm": 5, "from_s": 0.02, "to_s": 0.1},
    {"effect": "dropped_samples", "share": 0.3},
    {"effect": "angle_dependent_drag", "joints": [2], "nm_s_rad": 20},
    {"effect": "angle_dependent_friction", "joints": [2], "nm": 5},
    {"effect": "cross_drag", "joint": 1, "driven_by": 2, "nm_s_rad": 30},
    {"effect": "damaged_tooth", "joints": [2], "nm": 8, "at_rad": -1.0},
    {"effect": "hose", "joints": [2], "nm": 5},
    {"effect": "hysteresis_loop", "joints": [2], "nm": 30, "width_rad": 0.1},
    {"effect": "mass_change", "joint": 2, "nm": 5, "at_s": 0.05},
    {"effect": "one_sided_stop", "joints": [4], "nm_rad": 10, "beyond_rad": 2.45},
    {"effect": "slosh", "joints": [2], "kg_m2": 0.5, "hz": 3},
    {"effect": "speed_limited_torque", "joints": [2, 3], "stall_nm": 0.4, "no_load_rad_s": 30},
    {"effect": "supply_sag", "joints": [2, 3], "share_per_watt": 0.1},
    {"effect": "torque_dead_zone", "joints": [2, 3], "nm": 0.2},
    {"effect": "vibration", "joints": [2], "nm": 5, "hz": 8},
]


def make(tmp_path, *effects):
    path = tmp_path / "hidden.yaml"
    path.write_text(f"effects: {list(effects)!r}\n".replace("True", "true"))
    return path


@pytest.fixture
def hide(tmp_path):
    """Physics of a two-joint arm with effects in it."""

    def with_effects(*effects):
        path = make(tmp_path, *effects)
        names = tuple(str(k) for k in range(20))
        delta = np.zeros(20)
        truth = Truth(names, delta, VISCOUS, COULOMB, np.zeros(2), RATIOS, 0)
        physics = plain_physics(truth, np.array([0.0, 0.0, -9.81]))
        return hidden(physics, read_hidden_file(path), 0, path)

    return with_effects


def state(q=(0.0, 0.0), qd=(0.0, 0.0), motor=(0.0, 0.0), time_s=0.0):
    motor = np.array(motor, dtype=float)
    zero = np.zeros(2)
    return StepState(
        time_s,
        H,
        np.array(q, dtype=float),
        np.array(qd, dtype=float),
        motor,
        RATIOS.T @ motor,
        zero.copy(),
        zero.copy(),
        np.array([-COULOMB, COULOMB]),
    )


def met(physics, **at):
    """A state after all effects at motors and joints have acted on it."""
    now = state(**at)
    for act in (*physics.on_motors, *physics.on_joints):
        act(now)
    return now


def test_every_effect_of_the_catalogue_is_tried_below():
    kinds = [*get_args(Known), *get_args(OutsideCatalogue)]
    names = {get_args(kind.model_fields["effect"].annotation)[0] for kind in kinds}
    assert names == {effect["effect"] for effect in ALL}
    assert len(get_args(OutsideCatalogue)) >= 8


@pytest.fixture(scope="module")
def wam():
    """What a simulated WAM is made of."""
    file = load_arm_file("wam7.yaml")
    urdf = find_file("wam7.urdf").read_text()
    robot = load_robot(urdf, file.robot.joints, file.robot.parameter_frames)
    truth = draw_truth(robot, file.transmission, file.simulation, 0)
    far = np.full(7, 99.0)
    stops = EndStops(-far, far, far, far)
    physics = plain_physics(truth, np.array([0.0, 0.0, -9.81]))
    return robot, physics, stops, np.array(file.simulation.start_pose_rad)


def positions(wam, path, cycles=60):
    """Joint positions of a falling WAM, as its encoders see them [rad], shape (cycles, 7)."""
    robot, physics, stops, start = wam
    if path is not None:
        physics = hidden(physics, read_hidden_file(path), 0, path)
    plant = Plant(robot, physics, stops, start, 250_000)
    seen = []
    for k in range(cycles):
        torque = np.array([0.3, 0.4, -0.4, -0.3, 0.05, 0.05, 0.02]) * np.cos(0.05 * k)
        plant.advance(k * 2_000_000, torque, np.zeros(7))
        seen.append(plant.seen_at(plant.time_ns))
    return np.array(seen)


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e["effect"])
def test_it_shows_in_the_motion_and_is_the_same_every_time(effect, wam, tmp_path):
    path = make(tmp_path, effect)
    seen, again = positions(wam, path), positions(wam, path)
    np.testing.assert_array_equal(seen, again)
    assert np.abs(seen - positions(wam, None)).max() > 1e-4


def test_a_constant_offset_resists_positive_motion(hide):
    now = met(hide({"effect": "torque_offset", "joints": [2], "nm": 0.5}))
    np.testing.assert_allclose(now.torque, [0.0, -0.5])


def test_asymmetric_friction_never_pushes(hide):
    effect = {"effect": "torque_offset", "form": "asymmetric_coulomb", "joints": [1, 2]}
    now = met(hide({**effect, "nm": [0.5, -3.0]}))
    np.testing.assert_allclose(now.bounds, [[-1.5, -4.0], [2.5, 0.0]])


@pytest.mark.parametrize(("form", "share"), [("exponential", np.exp(-2)), ("gaussian", np.exp(-4))])
def test_stribeck_friction_falls_off_with_speed(hide, form, share):
    effect = {"effect": "stribeck", "form": form, "joints": [1], "extra_nm": 0.6}
    physics = hide({**effect, "speed_rad_s": 0.1})
    assert met(physics).bounds[1, 0] == pytest.approx(2.6)
    assert met(physics, qd=(-0.2, 0.0)).bounds[1, 0] == pytest.approx(2.0 + 0.6 * share)
    assert met(physics, qd=(-0.2, 0.0)).bounds[0, 1] == -1.0


@pytest.mark.parametrize("form", ["dahl", "lugre"])
def test_a_bristle_is_a_spring_first_and_coulomb_friction_later(hide, form):
    physics = hide({"effect": "presliding", "form": form, "joints": [1], "stiffness_nm_rad": 1e3})
    assert physics.truth.coulomb[0] == 0.0
    assert physics.truth.coulomb[1] == 1.0
    first = met(physics, qd=(0.04, 0.0)).torque[0]
    assert first == pytest.approx(-1e3 * 0.04 * H, rel=0.01)
    for _ in range(20_000):
        last = met(physics, qd=(0.04, 0.0)).torque[0]
    assert last == pytest.approx(-2.0, rel=1e-6)
    for _ in range(20_000):
        last = met(physics, qd=(-0.04, 0.0)).torque[0]
    assert last == pytest.approx(2.0, rel=1e-6)


def test_drag_by_powers_of_speed(hide):
    effect = {"effect": "nonlinear_viscous", "joints": [1], "quadratic_nm_s2_rad2": 2.0}
    now = met(hide({**effect, "cubic_nm_s3_rad3": 3.0, "power_nm": 0.5}), qd=(-0.25, 1.0))
    assert now.drag[0] == pytest.approx(2.0 * 0.25 + 3.0 * 0.25**2)
    assert now.torque[0] == pytest.approx(0.5 * 0.25**0.5)
    assert now.drag[1] == now.torque[1] == 0.0


def test_viscous_friction_with_a_direction(hide):
    physics = hide({"effect": "asymmetric_viscous", "joints": [2], "nm_s_rad": 0.1})
    assert met(physics, qd=(1.0, 2.0)).drag.tolist() == [0.0, 0.1]
    assert met(physics, qd=(1.0, -2.0)).drag.tolist() == [0.0, -0.1]


def test_friction_grows_with_the_load(hide):
    physics = hide({"effect": "load_dependent_friction", "joints": [1], "share": 0.1})
    now = met(physics, motor=(0.3, -0.3))
    np.testing.assert_allclose(now.bounds, [[-2.6, -1.0], [2.6, 1.0]])


def test_friction_on_motors_slides_with_their_speed(hide):
    physics = hide(
        {"effect": "coupled_friction", "joints": [2], "coulomb_nm": 0.1, "viscous_nm_s_rad": 0.01}
    )
    np.testing.assert_array_equal(physics.slides, RATIOS[1:])
    np.testing.assert_array_equal(physics.slide_torque, [0.1])
    np.testing.assert_allclose(physics.drag, 0.01 * np.outer(RATIOS[1], RATIOS[1]))


def test_a_cold_arm_rubs_more(hide):
    physics = hide({"effect": "thermal_drift", "joints": [1], "share": 0.5, "time_constant_s": 10})
    assert met(physics).bounds[1].tolist() == [3.0, 1.0]
    warm = met(physics, time_s=10.0)
    assert warm.bounds[1, 0] == pytest.approx(2.0 * (1 + 0.5 / np.e))
    assert warm.drag[0] == pytest.approx(VISCOUS[0] * 0.5 / np.e)


def test_inertia_of_rotors(hide):
    physics = hide(
        {"effect": "rotor_inertia", "joints": [2], "kg_m2": 0.3},
        {"effect": "coupled_inertia", "joints": [1, 2], "kg_m2": 1e-3},
    )
    np.testing.assert_allclose(physics.armature, np.diag([0.0, 0.3]) + 1e-3 * RATIOS.T @ RATIOS)


def test_a_payload_adds_its_mass_and_states_to_the_last_link(hide):
    physics = hide({"effect": "payload", "kg": 2.0, "at_m": [0.0, 0.0, 0.5], "radius_m": 0.0})
    np.testing.assert_array_equal(physics.truth.delta[:10], 0.0)
    np.testing.assert_allclose(physics.truth.delta[10:], [0.5, 0, 0, 0.5, 0, 0, 0, 0, 1.0, 2.0])


def test_a_tilted_base_sees_gravity_tilted_the_other_way(hide):
    physics = hide({"effect": "gravity_tilt", "x_rad": 0.1})
    expected = [0.0, -9.81 * np.sin(0.1), -9.81 * np.cos(0.1)]
    np.testing.assert_allclose(physics.gravity_m_s2, expected)


def test_an_offset_shows_in_what_the_encoders_see(hide):
    (see,) = hide({"effect": "encoder_offset", "joints": [1], "rad": 0.02}).encoder_models
    np.testing.assert_allclose(see(np.array([0.5, 0.6]), state()), [0.52, 0.6])


def settled(physics, motor):
    """A held link under a motor's steady torque: what pushes it, and where the motor comes to."""
    (act,), (see,) = physics.on_joints, physics.encoder_models
    for _ in range(20_000):
        now = state(motor=motor)
        act(now)
    return now, see(np.zeros(2), now)


@pytest.mark.parametrize(("inertia", "friction"), [(0.02, 0.0), (1e-4, 0.0), (0.02, 0.5)])
def test_a_spring_carries_the_torque_and_gives(hide, inertia, friction):
    """Friction on the motor, half of it, may keep the spring from all of the torque."""
    physics = hide({
        "effect": "joint_elasticity", "joints": [2], "nm_rad": 100.0,
        "motor_kg_m2": inertia, "friction_on_motor": friction,
    })  # fmt: skip
    now, seen = settled(physics, (3.0, 3.0))
    load = (RATIOS.T @ [3.0, 3.0])[1]
    assert seen[0] == 0.0
    assert seen[1] == pytest.approx(load / 100.0, abs=friction * COULOMB[1] / 100.0 + 1e-6)
    assert now.load[1] + now.torque[1] == pytest.approx(100.0 * seen[1], rel=1e-6)
    assert now.bounds[1, 1] == pytest.approx((1.0 - friction) * COULOMB[1])
    assert now.drag[1] == pytest.approx(-friction * VISCOUS[1])
    assert physics.armature[1, 1] == -inertia


def test_a_motor_in_its_play_pushes_nothing_until_the_stop(hide):
    """Its way there is that of free fall: half the play after sqrt(2 b J / torque)."""
    physics = hide({
        "effect": "backlash", "joints": [1], "rad": 0.02, "motor_kg_m2": 0.05,
        "friction_on_motor": 0.0,
    })  # fmt: skip
    (act,), (see,) = physics.on_joints, physics.encoder_models
    load = (RATIOS.T @ [1.0, 0.0])[0]
    crossing = int(np.sqrt(2 * 0.01 * 0.05 / abs(load)) / H)
    for _ in range(crossing - 1):
        now = state(motor=(1.0, 0.0))
        act(now)
        assert now.load[0] + now.torque[0] == 0.0
    assert abs(see(np.zeros(2), now)[0]) < 0.01
    now, seen = settled(physics, (1.0, 0.0))
    give = load / (0.05 * (2 * np.pi * 150.0) ** 2)
    assert seen[0] == pytest.approx(np.sign(load) * 0.01 + give, rel=1e-3)
    assert now.load[0] + now.torque[0] == pytest.approx(load, rel=1e-3)


def test_a_motor_has_its_part_of_friction_that_other_effects_add(hide):
    """Under less torque than its part of all dry friction it stays where it is."""
    extra = {"effect": "stribeck", "joints": [2], "extra_nm": 3.0, "speed_rad_s": 0.1}
    tie = {"effect": "joint_elasticity", "joints": [2], "nm_rad": 100.0, "friction_on_motor": 0.5}
    physics = hide(extra, tie)
    for _ in range(1000):
        now = met(physics, motor=(0.2, 0.2))
    assert now.load[1] < 0.5 * (COULOMB[1] + 3.0)
    assert now.bounds[1, 1] == pytest.approx(0.5 * (COULOMB[1] + 3.0))
    (see,) = physics.encoder_models
    assert see(np.zeros(2), now)[1] == 0.0


def test_a_motor_heavier_than_its_joint_is_refused(tmp_path):
    path = make(tmp_path, {"effect": "backlash", "joints": [6], "rad": 0.01, "motor_kg_m2": 0.5})
    with pytest.raises(ConfigurationError, match="motor_kg_m2"):
        load_simulation("wam7.yaml", 0, path)


def test_a_spring_pulls_towards_its_rest(hide):
    physics = hide({"effect": "joint_spring", "joints": [1], "nm_rad": 2.0, "rest_rad": 0.5})
    assert met(physics, q=(1.5, 1.0)).torque.tolist() == [-2.0, 0.0]


def test_gain_and_saturation_of_motors(hide):
    physics = hide(
        {"effect": "torque_gain", "joints": [2], "factor": 1.5},
        {"effect": "torque_saturation", "joints": [1], "nm": 0.4},
    )
    np.testing.assert_allclose(met(physics, motor=(-1.0, 1.0)).motor, [-0.4, 1.5])


def test_a_delay_is_a_delay_and_a_lag_a_lag(hide):
    delayed = hide({"effect": "torque_delay", "joints": [1], "seconds": 4 * H})
    made = [met(delayed, motor=(1.0, 1.0)).motor.tolist() for _ in range(6)]
    assert made == [[0.0, 1.0]] * 4 + [[1.0, 1.0]] * 2
    lagging = hide({"effect": "torque_delay", "form": "lag", "joints": [1], "seconds": 0.01})
    made = [met(lagging, motor=(1.0, 1.0)).motor[0] for _ in range(40)]
    assert made[-1] == pytest.approx(1 - np.exp(-1.0))


def test_ripple_is_periodic_in_the_motor_angle(hide):
    physics = hide({"effect": "torque_ripple", "joints": [1], "nm": 0.1, "periods_per_turn": 6})
    angle = 0.02
    now = met(physics, q=(angle, 0.0), motor=(0.5, 0.0))
    assert now.motor[0] == pytest.approx(0.5 + 0.1 * np.sin(6 * 10 * angle))


def test_a_contact_comes_and_goes(hide):
    effect = {"effect": "contact", "joints": [2], "nm": 3.0, "from_s": 1.0, "to_s": 2.0}
    pushes = [met(hide(effect), time_s=t).torque[1] for t in (0.5, 1.0, 1.5, 2.0, 3.0)]
    np.testing.assert_allclose(pushes, [0, 0, 3.0, 0, 0], atol=1e-12)


def test_dropped_samples_repeat_the_reading_before(hide):
    (see,) = hide({"effect": "dropped_samples", "share": 0.2, "length": 2}).encoder_models
    true = np.arange(1, 5001) * 0.001
    seen = np.array([see(np.array([q, q]), state(time_s=q))[0] for q in true])
    late = seen != true
    assert 0.1 < late.mean() < 0.3
    assert np.all(np.isin(seen[late], true))


def test_sizes_must_fit_the_joints(hide, tmp_path):
    path = tmp_path / "hidden.yaml"
    with pytest.raises(ConfigurationError) as caught:
        hide({"effect": "joint_spring", "joints": [1, 2], "nm_rad": [1.0, 2.0, 3.0]})
    assert str(caught.value) == f"{path}: effects.0.joint_spring: 3 sizes for 2 joints."
    with pytest.raises(ConfigurationError) as caught:
        hide({"effect": "joint_spring", "joints": [3], "nm_rad": 1.0})
    assert str(caught.value) == f"{path}: effects.0.joint_spring: joint 3 of an arm with 2 joints."


def test_all_mistakes_of_a_hidden_file_are_told_at_once(tmp_path):
    path = tmp_path / "hidden.yaml"
    path.write_text(
        "effects:\n"
        "  - {effect: payload, kg: -1}\n"
        "  - {effect: vibration, joints: [], nm: 1, hz: 2}\n"
        "  - {effect: hose, joints: [1], nm: 1, colour: red}\n"
    )
    with pytest.raises(ConfigurationError) as caught:
        read_hidden_file(path)
    assert str(caught.value) == (
        f"{path}: 3 faults:\n"
        "  - effects.0.payload.kg: -1 should be greater than 0\n"
        "  - effects.1.vibration.joints: "
        "tuple should have at least 1 item after validation, not 0\n"
        "  - effects.2.hose.colour: unknown key"
    )
