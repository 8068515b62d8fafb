"""What a fit knows, and what it cannot know."""

import numpy as np
import pytest
from servo_arm import STEP_RAD, URDF

from ident.dynamics.compiled_chain import chain_of
from ident.output_error.first_guess import neutral
from ident.output_error.fit import fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.setup import MotionSegment, Prior, Setup
from ident.output_error.slopes import NEAR, columns, sure_columns
from ident.output_error.uncertainty import _in_units, alike, jackknifed, knowledge, unknown_factor
from wamctl.arm.robot import cad_parameters, load_robot

TRUTH = {
    "stiffness": 15.0, "damping": 0.6, "coulomb": 0.1, "armature": 0.02, "delay": 0.015,
    "turning_speed": 0.006,
}  # fmt: skip
FITTED = ("stiffness", "damping", "coulomb", "armature", "delay")


def recorded(gravity: float, seconds: float = 20.0) -> tuple[Setup, np.ndarray]:
    """The elbow alone, as its own simulation records it with a 12-bit encoder."""
    robot = load_robot(URDF, ("elbow",), gravity_m_s2=(0.0, 0.0, gravity))
    settings = neutral(1)
    for name, value in TRUTH.items():
        settings[ROW[name]] = value
    t = np.arange(0.0, seconds, 0.02)
    phases = np.random.default_rng(2).uniform(0.0, 6.28, 3)
    hz, size = np.array([0.13, 0.6, 1.4]), np.array([0.8, 0.3, 0.1])
    command = (np.sin(2 * np.pi * np.outer(t, hz) + phases) @ size)[:, None]
    motion = Motion(t, t.copy(), command, command[0].copy(), np.zeros(1))
    empty = MotionSegment(motion, np.zeros_like(command), counted=50)
    setup = Setup(chain_of(robot), cad_parameters(robot), np.array([True]), (empty,), 0.001)
    (q,) = setup.replay(settings)
    told = np.round(q / STEP_RAD) * STEP_RAD
    segment = MotionSegment(motion, told, counted=50)
    return Setup(setup.chain, setup.delta, setup.at_link, (segment,), 0.001), settings


def believed(settings: np.ndarray) -> tuple[np.ndarray, Prior]:
    free = np.zeros(settings.shape, dtype=bool)
    free[[ROW[name] for name in FITTED]] = True
    return free, Prior(settings, np.full(settings.shape, 3.0), np.full(len(QUANTITIES), np.inf))


def known(setup: Setup, settings: np.ndarray):
    free, prior = believed(settings)
    found = fit(setup, settings, free, prior, 3)
    return knowledge(setup, found, prior)


def test_a_joint_without_weight_does_not_know_its_torques():
    """Rotor and link are one inertia there, so that all torques may be larger together."""
    told = known(*recorded(0.0))
    assert told.sd[ROW["stiffness"], 0] > 0.3 * TRUTH["stiffness"]
    assert unknown_factor(told).tolist() == [True]


def test_settings_that_are_simulated_at_one_time_do_not_touch_each_other():
    setup, settings = recorded(-9.81, 4.0)
    some = [settings * factor for factor in (1.0, 1.1, 0.9, 1.2, 1.3)]
    for left, own in zip(setup.residuals_of(some), some, strict=True):
        assert left.tolist() == setup.residuals(own).tolist()


def test_a_joint_that_lifts_knows_them():
    told = known(*recorded(-9.81))
    assert told.sd[ROW["stiffness"], 0] < 0.05 * TRUTH["stiffness"]
    assert unknown_factor(told).tolist() == [False]


def test_torques_are_known_no_better_than_the_centres_of_mass():
    """To a millimetre, which is a hundredth of the elbow's lever."""
    told = known(*recorded(-9.81, 60.0))
    assert told.torque_factor_sd == pytest.approx([0.01], rel=0.2)


@pytest.mark.parametrize("at", ["low", "high"])
def test_a_setting_on_its_bound_has_a_derivative(at):
    setup, settings = recorded(-9.81, 4.0)
    row = ROW["load_friction"]
    settings[row], settings[ROW["load_side"]] = getattr(QUANTITIES[row], at), 0.0
    free = np.zeros(settings.shape, dtype=bool)
    free[row] = True
    far, near = (columns(setup, settings, free, reach) for reach in (1.0, NEAR))
    assert np.isfinite([far, near]).all()
    assert np.abs(near).max() > 1e-4
    assert far == pytest.approx(near, abs=0.2 * np.abs(near).max())


def test_errors_that_repeat_with_the_motion_do_not_average_out():
    """Twice as long a recording of the same motion halves the variance of chance errors only."""
    rng = np.random.default_rng(0)
    speed = np.sin(np.arange(8000) * 2 * np.pi / 800)
    repeated = np.sign(speed)[None] * 0.1
    once, twice = (alike(repeated[:, :k], speed[:k])[0, 0] / k**2 for k in (4000, 8000))
    assert twice == pytest.approx(once, rel=0.01)
    noise = rng.standard_normal((200, 8000))
    once, twice = (np.trace(alike(noise[:, :k], speed[:k])) / k**2 for k in (4000, 8000))
    assert twice == pytest.approx(once / 2, rel=0.1)


def test_blocks_that_the_fit_follows_most_are_not_taken_for_the_surest():
    """Three of twenty blocks tell most; what a fit of all leaves of their errors is too little."""
    rng = np.random.default_rng(1)
    J = np.ones((1, 1000, 1))
    J[0, :150] = 5.0
    hessian = np.sum(J**2, axis=(1, 2))[None]
    told, plain, moved = [], [], []
    for _ in range(400):
        error = np.repeat(rng.standard_normal(20), 50)[:, None]
        moved.append(float(np.sum(J[0] * error) / hessian[0, 0]))
        left = error - J[0] * moved[-1]
        told.append(float(jackknifed(J, left, hessian, 20)[0, 0]))
        pulls = np.add.reduceat(J[0] * left, np.arange(0, 1000, 50), axis=0)
        plain.append(float(np.sum(pulls**2) / hessian[0, 0] ** 2))
    assert np.mean(plain) < 0.85 * np.var(moved)
    assert np.var(moved) < np.mean(told) < 2.0 * np.var(moved)


def test_what_is_uneven_where_a_joint_sticks_is_no_knowledge():
    """Without weight, rotor and the other torques do all that the common factor could do."""
    setup, settings = recorded(0.0, 40.0)
    settings[ROW["turning_speed"]] = 0.0
    free, prior = believed(settings)
    short = columns(setup, settings, free)[:, :, 0]
    sure = sure_columns(setup, settings, free, prior)[:, :, 0]
    own = [J[0] - J[1:].T @ np.linalg.lstsq(J[1:].T, J[0])[0] for J in (short, sure)]
    assert np.linalg.norm(own[1]) < 0.4 * np.linalg.norm(own[0])
    assert np.linalg.norm(sure[0]) > 0.05


def test_the_longer_side_of_an_interval_is_told():
    """Of what the common factor of torques scales too."""
    settings = neutral(1)
    settings[ROW["torque_limit"]], settings[ROW["offset"]] = 2.0, 0.3
    rows, cov = [ROW[name] for name in ("stiffness", "torque_limit", "offset")], np.zeros((3, 3))
    cov[0, 0] = 0.5**2
    sd = _in_units(settings[:, 0], np.array(rows), cov)
    assert settings[rows, 0] + 1.645 * sd == pytest.approx(settings[rows, 0] * np.exp(1.645 * 0.5))
