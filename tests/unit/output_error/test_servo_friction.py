"""Friction that turns round in another way does not pass for inertia or less friction."""

import numpy as np
import pytest
from servo_arm import STEP_RAD, URDF

from ident.dynamics.compiled_chain import chain_of
from ident.output_error.first_guess import first_guess
from ident.output_error.fit import fit
from ident.output_error.missing.forms import middle_form
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.search.parts import BASE, STRIBECK
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import MotionSegment, Prior, Setup
from ident.output_error.uncertainty import knowledge
from ident.regression.progress import silent
from wamctl.arm.robot import cad_parameters, load_robot

TRUTH = {"stiffness": 15.0, "damping": 0.6, "coulomb": 0.1, "armature": 0.02}
INERTIA, WEIGHT = 2e-3 + 0.3 * 0.1**2, 0.3 * 9.81 * 0.1
STEP_S, PER_SAMPLE, DELAY_STEPS = 0.0005, 40, 30
BRISTLE_RAD, RISE_RAD_S = 1e-3, 0.004
PEAK, PEAK_RAD_S = 0.12, 0.12


def moved(command: np.ndarray, form: str) -> np.ndarray:
    """What a 12-bit encoder tells of a servo with a pendulum, one explicit step after the other."""
    k, d, level, armature = TRUTH.values()
    q, v, bent, told = command[0], 0.0, 0.0, np.empty_like(command)
    for i in range(len(command) * PER_SAMPLE):
        if i % PER_SAMPLE == 0:
            told[i // PER_SAMPLE] = np.round(q / STEP_RAD) * STEP_RAD
        goal = command[max(i - DELAY_STEPS, 0) // PER_SAMPLE]
        high = level + PEAK * np.exp(-abs(v) / PEAK_RAD_S) if form == "peak" else level
        if form in ("bristles", "peak"):
            bent += STEP_S * v * (1 - np.sign(v) * bent / BRISTLE_RAD)
            friction = high * bent / BRISTLE_RAD
        else:
            friction = level * v / (abs(v) + RISE_RAD_S)
        torque = k * (goal - q) - d * v - friction + WEIGHT * np.cos(q)
        v += STEP_S * torque / (armature + INERTIA)
        q += STEP_S * v
    return told


def setup_of(form: str) -> tuple[Setup, Prior]:
    """The recording of such a joint, and what is believed of it."""
    robot = load_robot(URDF, ("elbow",))
    t = np.arange(0.0, 40.0, 0.02)
    hz, wide = np.array([0.11, 0.37, 0.9, 1.7]), np.array([0.5, 0.25, 0.12, 0.05])
    phases = np.random.default_rng(5).uniform(0.0, 6.28, 4)
    command = np.sin(2 * np.pi * np.outer(t, hz) + phases) @ wide
    q = moved(command, form)[:, None]
    motion = Motion(t, t.copy(), command[:, None], q[0].copy(), np.zeros(1))
    segments = (MotionSegment(motion, q, counted=50),)
    setup = Setup(chain_of(robot), cad_parameters(robot), np.array([True]), segments, 0.001)
    n = len(QUANTITIES)
    start = first_guess(setup, np.full((n, 1), np.nan), same_servo=False)
    prior = Prior(start, np.full((n, 1), 3.0), np.full(n, np.inf))
    return setup, prior


@pytest.mark.parametrize(("form", "tells", "size"), [
    ("bristles", "presliding", BRISTLE_RAD), ("rising", "rise_speed", RISE_RAD_S),
])  # fmt: skip
def test_rotor_and_friction_beside_another_form_of_friction(form, tells, size):
    setup, prior = setup_of(form)
    n, start = len(QUANTITIES), prior.center
    free = np.isin(np.arange(n), [ROW[name] for name in BASE])[:, None]
    found = fit(setup, start, free, prior)
    sd = knowledge(setup, found, prior).sd
    assert found.settings[ROW[tells], 0] == pytest.approx(size, rel=0.5)
    for name in ("armature", "coulomb"):
        off = found.settings[ROW[name], 0] - TRUTH[name]
        assert abs(off) < 0.025 * TRUTH[name], (name, off / TRUTH[name])
        assert abs(off) < 2.6 * sd[ROW[name], 0], (name, off / sd[ROW[name], 0])


def test_the_size_of_stribeck_friction_is_known_no_better_than_its_form():
    """The peak at rest is taken for a bell of 0.6 times its height, which fits as well."""
    setup, prior = setup_of("peak")
    start = prior.center.copy()
    start[ROW["stribeck"]] = 0.05
    free = np.isin(np.arange(len(start)), [ROW[name] for name in (*BASE, *STRIBECK.quantities)])
    bell = fit(setup, start, free[:, None], prior)
    found, spread = middle_form(setup, prior, bell, [(STRIBECK, 0)], SearchSettings(), silent)
    place = ROW["stribeck"], 0
    assert found.rms == pytest.approx(bell.rms, rel=0.05)
    for one, held in ((bell, False), (found, True)):
        sd = np.hypot(knowledge(setup, one, prior).sd[place], held * spread[place])
        assert (abs(one.settings[place] - PEAK) < 1.645 * sd) == held
