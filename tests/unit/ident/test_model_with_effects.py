"""A model with named effects: its torque against that of a simulated arm which has them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import yaml
from scipy import ndimage, signal

from ident.dynamics.parameters import Terms, standard_parameters
from ident.effects.bound_effects import bound, load_model
from ident.effects.catalogue import catalogue
from ident.effects.simulated_model import simulation_of
from ident.model.arm import arm_from_file
from ident.model.fit_filter import Filter
from ident.model.identified_model import Model, NoEffects
from ident.model.records import EffectRecord
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import _simulate, recorded, run
from wamctl.arm.config import load_arm_file
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording
from wamctl.arm.robot import cad_parameters
from wamctl.arm.trajectory import Reference

ALL = tuple(range(1, 8))
PERIOD = 0.002


def record(name, joints, parameters, settings=None, variant="", rows=None) -> EffectRecord:
    return EffectRecord(
        name=name,
        joints=joints,
        rows=rows or joints,
        parameters=parameters,
        settings=settings or {},
        variant=variant,
    )


EFFECTS = [
    record("torque_offset", (2,), {"offset": 2.0}),
    record("stribeck", (4,), {"extra_friction": 1.5}, {"speed": 0.4, "exponent": 1.0}),
    record("presliding", (2,), {"friction": 2.0}, {"distance": 0.02}, "dahl"),
    record("nonlinear_viscous", (4,), {"drag": 2.0}, {"power": 2.0}),
    record("asymmetric_viscous", (2,), {"half_difference": 2.0}),
    record("load_dependent_friction", (2,), {"coefficient": 0.2}, {"about": 0.0}, "whole load"),
    record(
        "coupled_friction",
        (2, 3),
        {"viscous_1": 0.5, "coulomb_1": 1.5},
        {"motors": [1], "levers": [[1.0, -0.6]]},
        "with drag",
    ),
    record(
        "thermal_drift",
        (1,),
        {"coulomb_change": -2.0},
        {"time_constant": 5.0, "over": 6.0},
        "coulomb",
    ),
    record("rotor_inertia", (4,), {"inertia": 0.5}),
    record("coupled_inertia", (2, 3), {"coupling": 0.2}, variant="coupling"),
    record(
        "payload",
        (7,),
        {"mass": 1.0, "first_moment_x": 0.0, "first_moment_y": 0.0, "first_moment_z": 0.1},
        {"about_z": 0.1},
        rows=ALL,
    ),
    record("gravity_tilt", ALL, {"tilt_x": 0.05, "tilt_y": -0.04}, {"axes": "xy"}),
    record("encoder_offset", (2,), {"offset": 0.03}, rows=ALL),
    record("joint_spring", (4,), {"stiffness": 2.0, "torque_at_zero": -1.0}),
    record("torque_gain", (2,), {"error": 0.1}),
    record("torque_delay", (2,), {"delay": 0.008}, {"about": 0.008}),
    record(
        "torque_ripple",
        (4,),
        {"sine": 0.8, "cosine": 0.3},
        {"order": 3.0, "turns": [4.0], "levers": [1.0]},
        "torque",
    ),
    record(
        "joint_elasticity",
        (2,),
        {"compliance": 1e-3},
        {"give": 1e-3, "rubbing": 0.0, "damped": 0.2, "motor_inertia": 0.1},
        rows=ALL,
    ),
    record(
        "backlash",
        (2,),
        {"half_play": 0.002},
        {"play": 0.002, "rubbing": 0.5, "motor_inertia": 0.2},
        rows=ALL,
    ),
    record(
        "measured_effect",
        (2,),
        {f"at_{k + 1}": 1.5 * np.sin(k) for k in range(9)},
        {"low": -1.0, "high": 1.0},
        "position",
    ),
    record("load_dependent_friction", (2,), {"coefficient": 0.2}, {"about": 0.2}, "motor torque"),
    record(
        "torque_gain",
        (2, 3),
        {"error_of_motor_2": 0.1},
        {"motor": 2, "shares": [[0.5, -0.3], [-5.0 / 6.0, 0.5]]},
    ),
    record(
        "measured_effect",
        (2,),
        {f"at_{k + 1}": 1.5 * np.sin(2 * k) for k in range(8)},
        {"low": -1.0, "high": -0.4},
        "angle",
    ),
    record(
        "measured_effect",
        (2, 4),
        {f"at_{k + 1}": 1.5 * np.sin(k) for k in range(1, 9)},
        {"low": -1.0, "high": 1.0},
        "other velocity velocity",
        (2,),
    ),
]


@cache
def plain() -> Model:
    """The shipped arm with its CAD's links and the simulator's friction."""
    file, robot = load_arm_file("wam7.yaml"), arm_from_file("wam7.yaml", ()).robot
    terms = Terms(True, True, False, False, np.eye(7), False)
    friction = {"fv": file.simulation.viscous_nm_s_rad, "fc": file.simulation.coulomb_nm}
    links = iter(cad_parameters(robot))
    delta = [
        next(links) if p.kind == "inertial" else friction[p.kind][p.index - 1]
        for p in standard_parameters(robot, terms)
    ]
    return Model(
        arm="wam7",
        estimator="feasible",
        robot=robot,
        terms=terms,
        delta=np.array(delta),
        moving=np.ones(7, dtype=bool),
        base_parameters=(),
        filter=Filter(5.0, 3, 20.0, 20.0, True, 0.05),
        noise=np.ones(7),
        logs=("a.mcap",),
    )


def named(item: EffectRecord) -> Model:
    return replace(plain(), effects=bound((item,)))


@cache
def motion() -> Reference:
    """Six seconds of sine waves, from rest."""
    t = PERIOD * np.arange(3000)[:, None]
    w = 2 * np.pi * np.array([0.5, 0.4, 0.6, 0.5, 0.7, 0.8, 0.9])
    start = np.array([0.0, -0.6, 0.0, 1.6, 0.0, 0.0, 0.0])
    wave, size = w * t, 0.3
    q = start + size * (1.0 - np.cos(wave))
    qd, qdd = size * w * np.sin(wave), size * w**2 * np.cos(wave)
    return Reference(t[:, 0], q, qd, qdd, slice(0, len(t)))


def run_of(model: Model) -> Recording:
    """The arm of the model on this motion, with encoders and torques of fine steps."""
    file = load_arm_file("wam7.yaml")
    wire = wire_for(file)
    fine = replace(
        wire,
        counts_per_revolution=1000 * wire.counts_per_revolution,
        torque_step=1e-6 * wire.torque_step,
    )
    wanted = motion().q, motion().qd, motion().qdd
    made = run(simulation_of(model), controller_for(file, model.robot), fine, wanted)
    return recorded(model.robot.joint_names, motion(), made, {}, {})


def error(model: Model, recording: Recording) -> np.ndarray:
    """Rms of the torque below 10 Hz that the model does not predict [N m], where joints move.

    The blow at the end of a play is one sample of the prediction, and several of the arm's.
    """
    assert recording.command is not None
    lowpass = signal.butter(3, 10.0, fs=1 / PERIOD, output="sos")
    left = recording.command.effort - model.predict(recording)
    left = signal.sosfiltfilt(lowpass, left, axis=0)
    speed = np.gradient(recording.q, PERIOD, axis=0)
    moving = np.abs(ndimage.uniform_filter1d(speed, 25, axis=0)) > 0.15
    moving[:300], moving[-300:] = False, False
    return np.sqrt((left**2 * moving).sum(axis=0) / moving.sum(axis=0))


@pytest.fixture(scope="module")
def floor() -> np.ndarray:
    return error(plain(), run_of(plain()))


@pytest.mark.parametrize("item", EFFECTS, ids=lambda e: e.name)
def test_the_torque_of_a_model_holds_its_effects(item, floor):
    recording = run_of(named(item))
    without, with_it = error(plain(), recording), error(named(item), recording)
    assert np.linalg.norm(with_it - floor) < 0.25 * np.linalg.norm(without - floor)
    assert (with_it < np.maximum(0.25 * without, 1.5 * floor + 0.005)).all()


@pytest.mark.parametrize("count", [2, 5])
def test_the_loop_is_compiled_once_for_any_number_of_effects(count, floor):
    """That takes many seconds."""
    compiled = len(_simulate.signatures)
    offsets = [record("torque_offset", (k + 1,), {"offset": 1.0}) for k in range(count)]
    run_of(replace(plain(), effects=bound(offsets)))
    assert len(_simulate.signatures) == compiled


def test_every_effect_is_tried():
    clipped = {"torque_saturation"}  # a motion that the arm follows is not clipped
    assert {e.name for e in EFFECTS} | clipped == set(catalogue())


@pytest.mark.parametrize("item", EFFECTS, ids=lambda e: e.name)
def test_numbers_are_read_by_their_names(item, tmp_path):
    """Sorted keys, as other programs write them, are the same model."""
    first, second = tmp_path / "model.yaml", tmp_path / "sorted.yaml"
    named(item).save(first)
    content = yaml.safe_load(first.read_text())
    second.write_text(yaml.safe_dump(content, sort_keys=True))
    q, qd, qdd = motion().q[::50], motion().qd[::50], motion().qdd[::50]
    told = named(item).inverse_dynamics(q, qd, qdd)
    for path in (first, second):
        model = load_model(path)
        assert model.effects.records[0].name == item.name
        np.testing.assert_allclose(model.inverse_dynamics(q, qd, qdd), told, atol=1e-9)
    assert np.abs(told - plain().inverse_dynamics(q, qd, qdd)).max() > 0.0 or item.name in (
        "torque_delay",
        "thermal_drift",
    )  # what nothing of one sample tells


def test_an_effect_of_a_file_that_lacks_a_number_is_refused():
    with pytest.raises(DataError, match="stribeck has the parameters extra; they must be extra_fr"):
        bound((record("stribeck", (4,), {"extra": 1.5}, {"speed": 0.1, "exponent": 2.0}),))
    with pytest.raises(DataError, match=r"stribeck cannot be used \(exponent: Field required"):
        bound((record("stribeck", (4,), {"extra_friction": 1.5}, {"speed": 0.1}),))
    with pytest.raises(DataError, match="holds an effect 'magic'; this program knows asymm"):
        bound((record("magic", (4,), {}),))
    with pytest.raises(DataError, match="thermal_drift has a variant 'cold' that is not known"):
        bound((EFFECTS[7].model_copy(update={"variant": "cold"}),))


def test_a_form_of_before_whose_size_meant_something_else_is_refused():
    with pytest.raises(DataError, match="load_dependent_friction has a variant 'driving load'"):
        bound(
            (record("load_dependent_friction", (2,), {"coefficient": 0.2}, None, "driving load"),)
        )


@pytest.mark.parametrize("item", EFFECTS, ids=lambda e: e.name)
def test_accelerations_and_torques_agree(item):
    model = named(item)
    q, qd, qdd = motion().q[::100], motion().qd[::100], motion().qdd[::100]
    tau = model.inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(model.forward_dynamics(q, qd, tau), qdd, atol=1e-6)
    if item.name in ("load_dependent_friction", "backlash", "joint_elasticity"):
        return  # their torque is not linear in the acceleration
    mass, rest = model.mass_matrix(q), np.zeros_like(q)
    parts = (mass @ qdd[..., None])[..., 0] + model.gravity(q)
    np.testing.assert_allclose(parts, model.inverse_dynamics(q, rest, qdd), atol=1e-6)


def test_friction_is_what_velocity_adds_beside_the_links():
    model = replace(plain(), effects=bound((EFFECTS[1], EFFECTS[13])))  # Stribeck and a spring
    qd = np.array([0.5, -0.5, 0.5, 0.2, -0.2, 0.1, -0.1])
    fv, fc = model.parameter("fv"), model.parameter("fc")
    expected = fv * qd + fc * np.sign(qd)
    expected[3] += 1.5 * np.exp(-0.2 / 0.4)
    np.testing.assert_allclose(model.friction(qd), expected, atol=1e-9)


def test_the_regressor_times_the_parameters_is_the_torque_of_links_and_friction():
    model = plain()
    q, qd, qdd = motion().q[::100], motion().qd[::100], motion().qdd[::100]
    columns = model.regressor(q, qd, qdd)
    assert columns.shape == (30, 7, len(model.delta))
    np.testing.assert_allclose(columns @ model.delta, model.inverse_dynamics(q, qd, qdd))
    assert model.regressor(q[0], qd[0], qdd[0]).shape == (7, len(model.delta))


def test_wrong_shapes_and_names_are_told():
    model, q = plain(), np.zeros((5, 7))
    assert model.effects.records == NoEffects().records == ()
    sentence = r"wam7 has 7 joints: give q, qd, qdd of one shape, \(S, 7\) or \(7,\), not q"
    with pytest.raises(DataError, match=sentence):
        model.inverse_dynamics(q, q[:4], q)
    with pytest.raises(DataError, match=sentence):
        model.inverse_dynamics(q.T, q.T, q.T)
    with pytest.raises(DataError, match=r"dt is -0\.1 for samples of shape"):
        model.inverse_dynamics(q, q, q, -0.1)
    with pytest.raises(DataError, match="no parameter 'fC'; the kinds are m, fv, fc, fo, ia, fvm"):
        model.parameter("fC")
    assert model.parameter("m").sum() == pytest.approx(model.inertial[9::10].sum())
    with pytest.raises(DataError, match="has parameters of shape"):
        replace(model, delta=model.delta[:-1])


def test_predictions_need_the_models_joints_and_some_time():
    recording = run_of(plain())
    with pytest.raises(DataError, match="has no joints wam/base_yaw_joint; it has other"):
        plain().predict(replace(recording, joint_names=("other", *recording.joint_names[1:])))
    short = replace(recording, stamp_ns=recording.stamp_ns[:3], q=recording.q[:3])
    with pytest.raises(DataError, match="3 samples are too few to differentiate"):
        plain().predict(short)
