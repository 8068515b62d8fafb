"""What a fit knows, and what it cannot know."""

import numpy as np
import pytest
from servo_arm import STEP_RAD, URDF

from ident.dynamics.compiled_chain import chain_of
from ident.output_error.first_guess import neutral
from ident.output_error.fit import NEAR, MotionSegment, Prior, Setup, columns, fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant import Motion
from ident.output_error.uncertainty import alike, knowledge, unknown_factor
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


def known(setup: Setup, settings: np.ndarray):
    free = np.zeros(settings.shape, dtype=bool)
    free[[ROW[name] for name in FITTED]] = True
    prior = Prior(settings, np.full(settings.shape, 3.0), np.full(len(QUANTITIES), np.inf))
    found = fit(setup, settings, free, prior, 3)
    return knowledge(setup, found, prior)


def test_a_joint_without_weight_does_not_know_its_torques():
    """Rotor and link are one inertia there, so that all torques may be larger together."""
    told = known(*recorded(0.0))
    assert told.sd[ROW["stiffness"], 0] > 0.3 * TRUTH["stiffness"]
    assert unknown_factor(told).tolist() == [True]


def test_a_joint_that_lifts_knows_them():
    told = known(*recorded(-9.81))
    assert told.sd[ROW["stiffness"], 0] < 0.05 * TRUTH["stiffness"]
    assert unknown_factor(told).tolist() == [False]


@pytest.mark.parametrize("at", ["low", "high"])
def test_a_setting_on_its_bound_has_a_derivative(at):
    setup, settings = recorded(-9.81, 4.0)
    row = ROW["load_friction"]
    settings[row] = getattr(QUANTITIES[row], at)
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
