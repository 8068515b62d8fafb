"""All torques of a joint together: where it lifts little, a fit has a long way with no slope."""

import numpy as np
import pytest
from servo_arm import STEP_RAD, URDF

from ident.dynamics.compiled_chain import chain_of
from ident.output_error.first_guess import neutral
from ident.output_error.fit import fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.setup import MotionSegment, Prior, Setup
from wamctl.arm.robot import cad_parameters, load_robot

TRUTH = {"stiffness": 15.0, "damping": 0.6, "coulomb": 0.1, "armature": 0.02, "offset": 0.2}
FACTOR = 40.0


def test_a_fit_comes_home_from_torques_that_are_forty_times_too_large() -> None:
    robot, truth = load_robot(URDF, ("elbow",)), neutral(1)
    for name, value in TRUTH.items():
        truth[ROW[name]] = value
    t = np.arange(0.0, 30.0, 0.02)
    hz, wide = np.array([0.11, 0.37, 0.9, 1.7]), np.array([0.5, 0.25, 0.12, 0.05])
    phases = np.random.default_rng(5).uniform(0.0, 6.28, 4)
    command = (np.sin(2 * np.pi * np.outer(t, hz) + phases) @ wide)[:, None]
    motion = Motion(t, t.copy(), command, command[0].copy(), np.zeros(1))
    links = chain_of(robot), cad_parameters(robot), np.array([True])
    (q,) = Setup(*links, (MotionSegment(motion, command),), 0.002).replay(truth)
    told = MotionSegment(motion, np.round(q / STEP_RAD) * STEP_RAD, counted=50)
    start, free = truth.copy(), np.zeros(truth.shape, dtype=bool)
    rows = [ROW[name] for name in TRUTH]
    start[rows] *= FACTOR
    free[rows] = True
    prior = Prior(neutral(1), np.full(truth.shape, 3.0), np.full(len(QUANTITIES), np.inf))
    found = fit(Setup(*links, (told,), 0.002), start, free, prior).settings
    for name, value in TRUTH.items():
        assert found[ROW[name], 0] == pytest.approx(value, rel=0.05), name
