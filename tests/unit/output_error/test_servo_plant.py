import numpy as np
import pytest
from scipy.signal import lsim
from servo_arm import URDF

from ident.dynamics.compiled_chain import chain_of
from ident.output_error.coordinates import coordinates, settings_at, turned
from ident.output_error.first_guess import neutral
from ident.output_error.parameters import PER_STIFFNESS, QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.setup import MotionSegment, Setup
from wamctl.arm.robot import load_robot


def pendulum(**values):
    """The elbow alone, weightless: inertia 5e-3 kg m^2 at the joint."""
    robot = load_robot(URDF, ("elbow",), gravity_m_s2=(0.0, 0.0, 0.0))
    settings = neutral(1)
    for name, value in {"coulomb": 1e-6, "delay": 0.0, "armature": 0.015, **values}.items():
        settings[ROW[name]] = value
    delta = np.concatenate([robot_parameters(robot)])
    return robot, settings, delta


def robot_parameters(robot):
    from wamctl.arm.robot import cad_parameters

    return cad_parameters(robot)


def replay(command, seconds=2.0, at_link=True, start=0.0, step=0.0005, **values):
    robot, settings, delta = pendulum(**values)
    t = np.arange(0, seconds, 0.02)
    u = np.array([[command(x)] for x in t])
    zero = np.array([start])
    motion = Motion(t, t.copy(), u, zero, np.zeros(1))
    setup = Setup(
        chain_of(robot),
        delta,
        np.array([at_link]),
        (MotionSegment(motion, np.zeros_like(u)),),
        step,
    )
    (made,) = setup.replay(settings)
    return t, made[:, 0]


def test_step_response_is_that_of_the_second_order_system():
    t, q = replay(lambda x: 0.1, stiffness=20.0, damping=0.4)
    inertia = 0.015 + 2e-3 + 0.3 * 0.1**2
    _, wanted, _ = lsim(([20.0], [inertia, 0.4, 20.0]), np.full(len(t), 0.1), t)
    assert np.abs(q - wanted).max() < 2e-3


def test_a_coarse_step_does_not_pass_for_inertia_or_delay():
    """The command's edge is felt inside a step, and the joint slows down much within one."""
    values = {"stiffness": 20.0, "damping": 0.6, "delay": 0.013}
    _, q = replay(lambda x: 0.1 if x > 0.51 else 0.0, step=0.004, **values)
    inertia = 0.015 + 2e-3 + 0.3 * 0.1**2
    fine = np.arange(0, 2.0, 0.0005)
    command = np.where(fine > 0.5329, 0.1, 0.0)
    _, wanted, _ = lsim(([20.0], [inertia, 0.6, 20.0]), command, fine)
    assert np.abs(q - wanted[::40]).max() < 1e-3


@pytest.mark.parametrize(("integral", "sag"), [(0.0, 0.5 / 20.0), (20.0, 0.0)])
def test_an_integral_carries_the_load_where_a_recording_begins(integral, sag):
    _, q = replay(lambda x: 0.0, stiffness=20.0, damping=0.6, offset=0.5, integral=integral)
    assert np.abs(q).max() == pytest.approx(sag, rel=0.2, abs=1e-4)


def test_friction_holds_what_the_servo_cannot_move():
    _, q = replay(lambda x: 0.01, stiffness=20.0, coulomb=0.25)
    assert np.abs(q).max() < 1e-6
    _, q = replay(lambda x: 0.02, stiffness=20.0, coulomb=0.25, damping=3.0)
    assert q[-1] == pytest.approx(0.02 - 0.25 / 20.0, abs=1e-4)


@pytest.mark.parametrize("play", [0.0, 1e-6])
def test_friction_that_turns_gradually_lets_a_joint_creep(play):
    """Below its turning speed, friction is a damper: the joint creeps to its command."""
    values = {"stiffness": 20.0, "coulomb": 0.25, "damping": 0.1, "turning_speed": 0.02}
    t, q = replay(lambda x: 0.01, half_play=play, **values)
    rate = 20.0 / (0.1 + 0.25 / 0.02)
    assert q[t > 0.2] == pytest.approx(0.01 * (1 - np.exp(-rate * t[t > 0.2])), abs=2e-4)


@pytest.mark.parametrize("play", [0.0, 1e-6])
@pytest.mark.parametrize("step", [0.0005, 0.002])
def test_bristles_give_way_and_come_back(play, step):
    """Below its friction a joint is held by a spring, and let go it returns: no creep, no loss."""
    values = {"stiffness": 20.0, "coulomb": 0.25, "damping": 0.5, "presliding": 0.004}
    held = 0.01 * 20.0 / (20.0 + 0.25 / 0.004)
    t, q = replay(lambda x: 0.01 if x < 1.0 else 0.0, half_play=play, step=step, **values)
    assert q[(t > 0.5) & (t < 1.0)] == pytest.approx(held, abs=2e-5)
    assert q[t > 1.5] == pytest.approx(0.0, abs=2e-5)


@pytest.mark.parametrize("play", [0.0, 1e-6])
@pytest.mark.parametrize(("values", "friction"), [
    ({"presliding": 0.004}, 0.25),  # all of it, beyond its path
    ({"presliding": 0.004, "rise_speed": 0.2}, 0.125),  # half of it, at that speed
])  # fmt: skip
def test_friction_of_steady_motion(values, friction, play):
    servo = {"stiffness": 20.0, "coulomb": 0.25, "damping": 0.5, "half_play": play}
    t, q = replay(lambda x: 0.2 * x, 4.0, **servo, **values)
    sampled = 0.2 * 0.01  # a command is held, so that it is half a sample late
    behind = (0.5 * 0.2 + friction) / 20.0 + sampled
    assert (0.2 * t - q)[-50:] == pytest.approx(behind, abs=3e-4)


def test_delay_shifts_the_answer():
    _, early = replay(lambda x: 0.1 if x > 0.5 else 0.0)
    _, late = replay(lambda x: 0.1 if x > 0.5 else 0.0, delay=0.04)
    assert late[2:] == pytest.approx(early[:-2], abs=1e-9)


def test_play_lets_the_link_rest_while_the_rotor_crosses_it():
    def wave(x):
        return 0.1 * np.sin(2 * np.pi * 0.5 * x)

    t, tight = replay(wave, seconds=8.0, at_link=False)
    _, rotor = replay(wave, seconds=8.0, at_link=False, half_play=0.02)
    _, link = replay(wave, seconds=8.0, at_link=True, half_play=0.02)
    assert np.abs(rotor - tight)[t > 2].max() < 0.01
    assert np.abs(link - tight)[t > 2].max() > 0.005


def test_a_rotor_behind_gears_that_do_not_give_is_one_with_the_other():
    def wave(x):
        return 0.1 * np.sin(2 * np.pi * 1.5 * x)

    _, q = replay(wave, link_armature=0.4)
    assert q == pytest.approx(replay(wave)[1], abs=1e-12)


@pytest.mark.parametrize(("lag", "behind"), [(0.0, 0.0), (0.02, 0.0), (0.02, 0.3)])
def test_gears_that_give_are_a_spring_beside_a_damper(lag, behind):
    """Rotor and link are the two masses that they tie, in continuous time."""
    stiff, rotor = 1.0 / 0.02, (1 - behind) * 0.015
    link = 2e-3 + 0.3 * 0.1**2 + behind * 0.015
    values = {"compliance": 0.02, "gear_lag": lag, "stiffness": 20.0, "damping": 0.4}
    values["link_armature"] = behind
    t, q = replay(lambda x: 0.1, step=0.00025, **values)
    tie = np.array([stiff, stiff * lag])  # per twist and its rate
    masses = np.array([[0, 1, 0, 0], [-tie[0], -tie[1] - 0.4, tie[0] - 20.0, tie[1]],
                       [0, 0, 0, 1], [tie[0], tie[1], -tie[0], -tie[1]]])  # fmt: skip
    masses[1] /= rotor
    masses[3] /= link
    plant = masses, [[0], [20.0 / rotor], [0], [0]], [[0, 0, 1, 0]], [[0]]
    _, wanted, _ = lsim(plant, np.full(len(t), 0.1), t)
    assert np.abs(q - wanted).max() < 2.5e-3


def test_a_planned_motion_keeps_its_acceleration():
    t, q = replay(
        lambda x: 1.0 if x > 0.01 else 0.0,
        stiffness=2000.0,
        damping=10.0,
        armature=0.001,
        profile_acceleration=4.0,
    )
    rising = (t > 0.1) & (t < 0.45)
    assert np.polyfit(t[rising], q[rising], 2)[0] == pytest.approx(2.0, rel=0.1)
    assert q[-1] == pytest.approx(1.0, abs=2e-3)


def test_coordinates_and_settings_belong_together():
    settings = neutral(2)
    assert settings_at(coordinates(settings)) == pytest.approx(settings)
    assert len(QUANTITIES) == len(ROW)


def test_all_torques_together_are_one_coordinate():
    """Where a joint lifts nothing, its positions do not depend on it."""
    settings, stiffness = neutral(1), ROW["stiffness"]
    settings[ROW["offset"]] = 0.3
    settings[ROW["torque_limit"]] = 2.0
    settings[ROW["integral_limit"]] = 1.0
    place = coordinates(settings)
    place[stiffness] += np.log(7.0)
    larger = settings_at(place)
    rows = [ROW[name] for name in ("stiffness", *PER_STIFFNESS)]
    assert larger[rows] == pytest.approx(7.0 * settings[rows])
    others = np.setdiff1d(np.arange(len(QUANTITIES)), rows)
    assert larger[others] == pytest.approx(settings[others])


def test_settings_turn_with_their_coordinates():
    settings = neutral(1)[:, 0]
    settings[[ROW["offset"], ROW["torque_limit"]]] = 0.3, 2.0
    rows = np.array([ROW[name] for name in ("stiffness", "offset", "coulomb", "delay", "zero")])
    made, step = turned(settings, rows), 1e-6
    for i, row in enumerate(rows):
        place = coordinates(settings[:, None])
        place[row] += step
        change = (settings_at(place)[:, 0] - settings)[rows] / step
        assert made[:, i] == pytest.approx(change, rel=1e-4, abs=1e-6)
