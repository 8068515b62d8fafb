"""Which parts of a servo a search keeps."""

import numpy as np
import pytest
from servo_arm import JOINTS, STEP_RAD, URDF, recording

from ident.dynamics.compiled_chain import chain_of
from ident.model.arm import arm_from_urdf
from ident.output_error.first_guess import neutral
from ident.output_error.fit import Fit, MotionSegment, Prior, Setup
from ident.output_error.identify import fit_of_all, prepared
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant import Motion
from ident.output_error.recordings import pieces, segments_of, settled
from ident.output_error.selection import BASE, PARTS, Chosen, chosen
from ident.regression.progress import silent
from wamctl.arm.robot import cad_parameters, load_robot

TRUTH = {
    "stiffness": 10.0, "damping": 0.6, "coulomb": 0.1, "armature": 1e-3, "delay": 0.004,
    "profile_acceleration": 40.0,
}  # fmt: skip


def found_parts(truth: dict[str, float], command: np.ndarray, names: tuple[str, ...]) -> Chosen:
    """The parts of one joint's servo that simulated recordings ask for."""
    robot, settings = load_robot(URDF, ("elbow",)), neutral(1)
    for name, value in truth.items():
        settings[ROW[name]] = value
    t = np.arange(len(command)) / 50
    motion = Motion(t, t.copy(), command, command[0].copy(), np.zeros(1))
    robot_and_links = chain_of(robot), cad_parameters(robot), np.array([True])
    empty = Setup(*robot_and_links, (MotionSegment(motion, command),), 0.002)
    (q,) = empty.replay(settings)
    cut = pieces([MotionSegment(motion, np.round(q / STEP_RAD) * STEP_RAD)], 10)
    fitted, judged = (
        Setup(*robot_and_links, tuple(c for i, c in enumerate(cut) if (i % 3 == 2) is side), 0.002)
        for side in (False, True)
    )
    start = neutral(1)
    prior = Prior(start, np.full(start.shape, 3.0), np.full(len(QUANTITIES), np.inf))
    parts = [p for p in PARTS if p.name in names]
    may = np.ones(start.shape, dtype=bool)
    return chosen(fitted, judged, start, prior, may, parts, False, silent)


def test_planned_acceleration_is_found_though_a_rotor_passed_for_it():
    """A hobby servo that plans its motion, along a sweep beyond what it plans."""
    t = np.arange(0.0, 40.0, 0.02)
    hz = 0.2 * 20.0 ** (t / t[-1])
    command = 0.15 * np.sin(2 * np.pi * np.cumsum(hz) * 0.02)[:, None]
    found = found_parts(TRUTH, command, ("profile",))
    assert found.trials[0].kept.all()
    assert found.fit.settings[ROW["profile_acceleration"], 0] == pytest.approx(40.0, rel=0.03)
    assert found.held_out[0] < STEP_RAD


def test_a_part_that_stood_in_for_a_later_one_is_taken_out_again():
    """Steps that a weak motor follows late look planned, until its limit is tried."""
    truth = TRUTH | {"profile_acceleration": 1e6, "armature": 0.02, "torque_limit": 2.0}
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 16.0, 0.02)
    command = np.repeat(0.4 * rng.standard_normal(len(t) // 50), 50) + 0.2 * np.sin(t)
    found = found_parts(truth, command[:, None], ("profile", "torque_limit"))
    profile, limit = found.trials
    assert profile.gain[0] > 0.02
    assert not profile.kept.any()
    assert limit.kept.all()
    assert found.fit.settings[ROW["torque_limit"], 0] == pytest.approx(2.0, rel=0.03)


def test_a_torque_limit_that_no_motion_reaches_is_taken_out():
    """Its fitted value says nothing; without it, reports and exports leave it out."""
    segments = settled(segments_of(recording(6.0), JOINTS, "log"))
    begun = prepared(arm_from_urdf(URDF, JOINTS, "urdf"), segments)
    start, free = begun.start.copy(), np.zeros(begun.may.shape, dtype=bool)
    free[[ROW[name] for name in (*BASE, "torque_limit")]] = True
    start[ROW["torque_limit"]] = (30.0, 0.6)  # N m: far beyond, and within, what is asked for
    found = fit_of_all(begun, Fit(start, free, np.empty(0), 0.0, 0), silent)
    assert found.free[ROW["torque_limit"]].tolist() == [False, True]
    assert found.settings[ROW["torque_limit"], 0] == QUANTITIES[ROW["torque_limit"]].first
