"""Which parts of a servo a search keeps."""

from dataclasses import replace

import numpy as np
import pytest
from servo_arm import JOINTS, STEP_RAD, STIFFNESS, URDF, commands, recording

from ident.dynamics.compiled_chain import chain_of
from ident.model.arm import arm_from_urdf
from ident.output_error.first_guess import neutral
from ident.output_error.fit import Fit
from ident.output_error.identify import fit_of_all, selected
from ident.output_error.judging import typical
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.prepared import Prepared, prepared, searched
from ident.output_error.recordings import segments_of, settled, thinned
from ident.output_error.search.late_start import begun_with_delay
from ident.output_error.search.parts import BASE, PARTS
from ident.output_error.search.selection import Selection
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import MotionSegment, Prior, Setup
from ident.regression.progress import silent
from wamctl.arm.config import ServoSection
from wamctl.arm.robot import cad_parameters

TRUTH = {
    "stiffness": 10.0, "damping": 0.6, "coulomb": 0.1, "armature": 1e-3, "delay": 0.004,
    "profile_acceleration": 40.0,
}  # fmt: skip


def found_parts(truth: dict[str, float], command: np.ndarray, names: tuple[str, ...]) -> Selection:
    """The parts of one joint's servo that a simulated recording asks for."""
    arm, settings = arm_from_urdf(URDF, ("elbow",), "urdf"), neutral(1)
    for name, value in truth.items():
        settings[ROW[name]] = value
    t = np.arange(len(command)) / 50
    motion = Motion(t, t.copy(), command, command[0].copy(), np.zeros(1))
    links = chain_of(arm.robot), cad_parameters(arm.robot), np.array([True])
    (q,) = Setup(*links, (MotionSegment(motion, command),), 0.002).replay(settings)
    told = MotionSegment(motion, np.round(q / STEP_RAD) * STEP_RAD, counted=25)
    start = neutral(1)
    prior = Prior(start, np.full(start.shape, 3.0), np.full(len(QUANTITIES), np.inf))
    may, one = np.ones(start.shape, dtype=bool), np.array([True])
    setup = Setup(*links, (told,), 0.002, np.array([STEP_RAD]))
    begun = Prepared(arm, setup, prior, may, one, ~may)
    settings = SearchSettings()
    begun, base = begun_with_delay(begun, begun.setup, settings)
    return selected(begun, base, [p for p in PARTS if p.name in names], settings, silent)


def test_planned_acceleration_is_found_though_a_rotor_passed_for_it():
    """A hobby servo that plans its motion, along a sweep beyond what it plans."""
    t = np.arange(0.0, 40.0, 0.02)
    hz = 0.2 * 20.0 ** (t / t[-1])
    command = 0.15 * np.sin(2 * np.pi * np.cumsum(hz) * 0.02)[:, None]
    found = found_parts(TRUTH, command, ("profile",))
    assert [a.part.name for a in found.accepted] == ["profile"]
    assert found.fit.settings[ROW["profile_acceleration"], 0] == pytest.approx(40.0, rel=1e-3)
    assert typical(found.errors)[0] < STEP_RAD  # beyond the plan, the sweep's end is chaotic


def test_a_part_does_not_stand_in_for_another():
    """Steps that a weak motor follows late look planned; its limit explains them better."""
    truth = TRUTH | {"profile_acceleration": 1e6, "armature": 0.02, "torque_limit": 2.0}
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 16.0, 0.02)
    command = np.repeat(0.4 * rng.standard_normal(len(t) // 50), 50) + 0.2 * np.sin(t)
    found = found_parts(truth, command[:, None], ("profile", "torque_limit"))
    gains = {part.name: gain[0] for part, gain in found.gains.items()}
    assert gains["torque_limit"] > gains["profile"] > 0.02
    assert [a.part.name for a in found.accepted] == ["torque_limit"]
    assert found.fit.settings[ROW["torque_limit"], 0] == pytest.approx(2.0, rel=0.03)


def test_a_search_sees_the_fastest_of_a_long_recording():
    """What limits a servo may show in its last seconds and nowhere before."""
    t = np.arange(0.0, 424.0, 0.02)
    q = np.column_stack([0.3 * np.sin(0.5 * t), 0.1 * np.sin(np.where(t < 416.0, 1.0, 15.0) * t)])
    whole = MotionSegment(Motion(t, t, q, q[0].copy(), np.zeros(2)), q, "log")
    seen = thinned((whole,))
    assert sum(s.motion.t[-1] - s.motion.t[0] for s in seen) < 150.0
    assert seen[-1].motion.t[-1] == t[-1]
    assert max(np.diff([s.motion.t[0] for s in seen])) < 50.0


def test_a_torque_limit_that_no_motion_reaches_is_taken_out():
    """Its fitted value says nothing; without it, reports and exports leave it out."""
    segments = settled(segments_of(recording(6.0), JOINTS, "log"))
    begun = prepared(arm_from_urdf(URDF, JOINTS, "urdf"), segments)
    start, free = begun.start.copy(), np.zeros(begun.may.shape, dtype=bool)
    free[[ROW[name] for name in (*BASE, "torque_limit")]] = True
    start[ROW["torque_limit"]] = (30.0, 0.6)  # N m: far beyond, and within, what is asked for
    made = begun.setup.replay(start)
    told = (
        replace(part, q=np.round(q / STEP_RAD) * STEP_RAD)
        for part, q in zip(begun.setup.segments, made, strict=True)
    )
    begun = replace(begun, setup=replace(begun.setup, segments=tuple(told)))
    found = fit_of_all(begun, Fit(start, free, np.empty(0), 0.0, 0), silent)
    assert found.free[ROW["torque_limit"]].tolist() == [False, True]
    assert found.settings[ROW["torque_limit"], 0] == QUANTITIES[ROW["torque_limit"]].first


def test_a_servo_that_feeds_the_weight_forward_is_told_from_a_stiff_one():
    """Nothing sags: without that part the stiffness comes out several times too large."""
    arm = arm_from_urdf(URDF, JOINTS, "urdf")
    segments = settled(segments_of(recording(fed_forward=1.0), JOINTS, "log"))
    parts = [p for p in PARTS if p.name in ("rate_gain", "integral", "gravity_gain")]
    settings = SearchSettings()
    begun = prepared(arm, segments)
    begun, base = begun_with_delay(begun, searched(begun.setup), settings)
    found = selected(begun, base, parts, settings, silent)
    assert {a.part.name for a in found.accepted} == {"gravity_gain"}
    assert found.fit.settings[ROW["gravity_gain"]] == pytest.approx(1.0, abs=0.05)
    assert base.fit.settings[ROW["stiffness"], 0] > 1.5 * STIFFNESS
    assert found.fit.settings[ROW["stiffness"], 0] == pytest.approx(STIFFNESS, rel=0.15)


def test_an_integral_that_is_clamped_keeps_its_gain():
    """Its torque ends at the clamp: without it, a weak integral is what comes near."""
    truth = TRUTH | {"profile_acceleration": 1e6, "armature": 0.02, "integral": 30.0}
    parts = ("integral", "integral_limit")
    found = found_parts(truth | {"integral_limit": 0.6}, commands(40.0, 0, 0.1)[:, 1:], parts)
    assert {a.part.name for a in found.accepted} == set(parts)
    assert found.fit.settings[ROW["integral"], 0] == pytest.approx(30.0, rel=0.05)
    assert found.fit.settings[ROW["integral_limit"], 0] == pytest.approx(0.6, rel=0.02)


def test_what_is_known_stays_while_the_stiffness_is_fitted():
    """Torques are fitted as parts of the stiffness; those that the arm's file fixes are not."""
    arm = arm_from_urdf(URDF, JOINTS, "urdf")
    known = ServoSection(fixed={"armature": 0.03, "torque_limit": 30.0})
    begun = prepared(replace(arm, servo=known), segments_of(recording(6.0), JOINTS, "log"))
    _, base = begun_with_delay(begun, searched(begun.setup), SearchSettings())
    assert (base.fit.settings[ROW["stiffness"]] != begun.start[ROW["stiffness"]]).all()
    assert base.fit.settings[ROW["armature"]].tolist() == [0.03, 0.03]
    assert base.fit.settings[ROW["torque_limit"]].tolist() == [30.0, 30.0]
