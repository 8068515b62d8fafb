"""Torques that hang on a joint's speed, and delays, in MuJoCo against the model's own."""

import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "ident"))
from test_export import coulomb, crane, mujoco_torque, states
from test_model_with_effects import plain, run_of

from ident.effects.bound_effects import bound
from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.replay import replay, rms_of
from ident.model.identified_model import Model
from ident.model.records import EffectRecord
from wamctl.arm.config import shipped_file

EXACT = 0.002


def effect(
    name: str,
    parameters: dict[str, float],
    settings: dict[str, float] | None = None,
    joint: int = 1,
) -> EffectRecord:
    return EffectRecord(
        name=name, joints=(joint,), rows=(joint,), parameters=parameters, settings=settings or {}
    )


SHAPE = {"speed": 0.2, "exponent": 1.0, "slow_decay": 0.0}


def stribeck(speed: float, slow_decay: float = 0.0, joint: int = 1) -> EffectRecord:
    shape = {"speed": speed, "exponent": 1.4, "slow_decay": slow_decay}
    return effect("stribeck", {"extra_friction": 1.5}, shape, joint)


def drag(size: float, power: float, joint: int = 1) -> EffectRecord:
    return effect("nonlinear_viscous", {"drag": size}, {"power": power}, joint)


def one_way(half: float, joint: int = 1) -> EffectRecord:
    return effect("asymmetric_viscous", {"half_difference": half}, joint=joint)


BY_SPEED = {
    "stribeck": (stribeck(0.03),),
    "stribeck, slow decay": (stribeck(0.2, 1.0, 2),),
    "sub-linear drag": (drag(0.8, 0.5),),
    "quadratic drag": (drag(0.8, 2.0),),
    "cubic drag that pulls": (drag(-0.01, 3.0, 2),),
    "one way more": (one_way(0.7),),
    "three at one joint, one at the other": (
        *(stribeck(0.1), drag(0.3, 1.5), one_way(-0.4)),
        stribeck(0.1, joint=2),
    ),
}


def with_effects(records: tuple[EffectRecord, ...]) -> Model:
    return replace(crane(), effects=bound(records))


def loaded(model: Model) -> mujoco.MjModel:  # pyright: ignore[reportAttributeAccessIssue]
    return mujoco.MjModel.from_xml_string(to_mjcf(model))  # pyright: ignore


@pytest.mark.parametrize("name", BY_SPEED)
def test_torque_that_hangs_on_speed_is_held(name: str) -> None:
    model, bare = with_effects(BY_SPEED[name]), crane()
    assert left_out_of_mjcf(model) == []
    q, qd, qdd = states(model)
    within = model.robot.model.velocityLimit / 3.0
    qd = qd * within * np.linspace(0.01, 1.0, len(qd))[:, None]  # slow ones too
    qd[-1] = model.robot.model.velocityLimit
    added = model.inverse_dynamics(q, qd, qdd) - bare.inverse_dynamics(q, qd, qdd)
    dry = loaded(model).dof_frictionloss - loaded(bare).dof_frictionloss
    rigid = coulomb(bare, qd) + dry * np.sign(qd)
    torque = mujoco_torque(to_mjcf(model), q, qd, qdd) + rigid
    off = np.abs(torque - model.inverse_dynamics(q, qd, qdd)).max(axis=0)
    assert (off <= EXACT * np.abs(added - dry * np.sign(qd)).max(axis=0) + 1e-9).all()


@pytest.mark.parametrize("name", BY_SPEED)
def test_a_sliding_joint_in_mujoco_follows_the_model(name: str) -> None:
    """Forward dynamics, with friction's constraint: the acceleration that the torque is for."""
    model = with_effects(BY_SPEED[name])
    simulated = loaded(model)
    data = mujoco.MjData(simulated)  # pyright: ignore
    for speed in np.array([[0.05, -0.08], [-0.3, 0.2], [0.9, 0.7]]):
        q, qdd = np.array([0.3, 0.2]), np.array([0.5, -0.5])
        data.qpos[:], data.qvel[:] = q, speed
        data.ctrl[:2] = model.inverse_dynamics(q, speed, qdd)
        mujoco.mj_forward(simulated, data)  # pyright: ignore
        np.testing.assert_allclose(data.qacc, qdd, atol=0.01)


def slid(model: Model, push: NDArray, seconds: float) -> NDArray:
    """Speeds after a constant torque, from rest, without gravity and limits."""
    simulated = loaded(model)
    simulated.opt.gravity[:] = 0.0
    simulated.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT  # pyright: ignore
    data = mujoco.MjData(simulated)  # pyright: ignore
    data.ctrl[:2] = push
    for _ in range(round(seconds / simulated.opt.timestep)):
        mujoco.mj_step(simulated, data)  # pyright: ignore
    return data.qvel


def test_stribeck_friction_holds_a_joint_at_rest_and_lets_go() -> None:
    """The step at rest is friction's: a push below it moves nothing, one above it breaks away."""
    model = replace(crane(offset=False), effects=bound((stribeck(0.05),)))
    level = float(loaded(model).dof_frictionloss[0])
    assert level == pytest.approx(float(model.parameter("fc")[0]) + 1.5)
    assert abs(slid(model, np.array([0.95 * level, 0.0]), 5.0)[0]) < 1e-3
    assert slid(model, np.array([1.05 * level, 0.0]), 5.0)[0] > 0.1


def test_a_motor_s_delay_is_held() -> None:
    late = effect("torque_delay", {"delay": 0.003}, {"about": 0.003})
    model = with_effects((late,))
    assert left_out_of_mjcf(model) == []
    simulated = loaded(model)
    data = mujoco.MjData(simulated)  # pyright: ignore
    given = []
    for k in range(14):
        data.ctrl[:2] = 7.0 if k >= 4 else 2.0
        mujoco.mj_step(simulated, data)  # pyright: ignore
        given.append(data.actuator_force[:2].copy())
    steps = round(0.003 / simulated.opt.timestep)
    first, second = np.array(given).T
    np.testing.assert_array_equal(second[4:], 7.0)
    np.testing.assert_array_equal(first[steps : 4 + steps], 2.0)
    np.testing.assert_array_equal(first[4 + steps :], 7.0)


def test_a_torque_that_acts_early_has_no_place() -> None:
    early = effect("torque_delay", {"delay": -0.004}, {"about": -0.004})
    (left,) = left_out_of_mjcf(with_effects((early,)))
    assert left.startswith("left out, since MJCF has no place for it: effect torque_delay of slew")
    assert (loaded(with_effects((early,))).actuator_delay == 0.0).all()


REPLAYED = {
    "stribeck of the elbow": (4, effect("stribeck", {"extra_friction": 0.9}, SHAPE, 4)),
    "stribeck of a light wrist": (7, effect("stribeck", {"extra_friction": 0.07}, SHAPE, 7)),
    "one way more": (3, one_way(0.5, 3)),
    "delay": (1, effect("torque_delay", {"delay": 0.02}, {"about": 0.02})),
}


@pytest.mark.parametrize("name", REPLAYED)
def test_a_wam_with_the_effect_goes_in_mujoco_where_it_goes_in_the_own_simulation(
    name: str,
) -> None:
    """In closed loop; friction that falls with speed made implicit steps blow up at the wrist."""
    joint, record = REPLAYED[name]
    model = replace(plain(), effects=bound((record,)))
    config = shipped_file("wam7.yaml").read_bytes()
    log = replace(run_of(model), attachments={"config.yaml": config})
    followed, other = (
        np.array(rms_of([replay(to_mjcf(x), x, log, "log")])["mujoco"]) for x in (model, plain())
    )
    assert followed.max() < 6e-4  # some steps of the encoders
    assert other[joint - 1] > 4 * followed[joint - 1]
