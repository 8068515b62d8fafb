"""Exported arms, loaded by Pinocchio and MuJoCo, against the model's own inverse dynamics."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import typer
from numpy.typing import NDArray
from typer.testing import CliRunner

from ident.commands.export import export
from ident.dynamics.parameters import Terms, standard_parameters, unit_rows
from ident.effects.bound_effects import bound
from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.urdf import left_out_of_urdf, to_urdf
from ident.model.fit_filter import Filter
from ident.model.identified_model import Model
from ident.model.records import EffectRecord
from wamctl.arm.config import beside, find_file, load_robot_file
from wamctl.arm.errors import DataError
from wamctl.arm.inertial import from_pseudo_inertia
from wamctl.arm.robot import Robot, load_robot

STATES = 1000
STRIBECK = EffectRecord(
    name="stribeck",
    joints=(1,),
    rows=(1,),
    parameters={"extra_friction": 1.5},
    settings={"speed": 0.1, "exponent": 1.0},
)
RIPPLE = EffectRecord(
    name="torque_ripple",
    variant="torque",
    joints=(1,),
    rows=(1,),
    parameters={"sine": 1.5, "cosine": 0.0},
    settings={"order": 3.0, "turns": [4.0], "levers": [1.0]},
)
SLIDER = """
<robot name="crane">
  <link name="base"><inertial><mass value="9"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="slew" type="revolute"><parent link="base"/><child link="mast"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
  <link name="mast"/>
  <joint name="reach" type="prismatic"><parent link="mast"/><child link="boom"/>
    <origin xyz="0.3 0 0.5" rpy="0 0.7 0"/><axis xyz="-1 0 0"/><dynamics damping="9" friction="9"/>
    <limit lower="0" upper="1" effort="70" velocity="1"/></joint>
  <link name="boom"><inertial><mass value="3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="wrist" type="revolute"><parent link="boom"/><child link="hook"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
  <link name="hook"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"""  # noqa: E501


def wam() -> tuple[Robot, NDArray]:
    file = load_robot_file("wam7.yaml")
    urdf = beside(find_file("wam7.yaml"), file.robot.urdf).read_text()
    robot = load_robot(urdf, file.robot.joints, file.robot.parameter_frames)
    assert file.transmission is not None
    return robot, unit_rows(np.array(file.transmission.motor_from_joint))


def identified(robot: Robot, drive_matrix: NDArray, **zero: bool) -> Model:
    """A model with random possible parameters; `offset=False` and the like leave a term out."""
    terms = Terms(
        viscous=True,
        coulomb=True,
        offset=zero.get("offset", True),
        rotor_inertia=zero.get("rotor_inertia", True),
        drive_matrix=drive_matrix,
        motor_friction=zero.get("motor_friction", True),
    )
    rng = np.random.default_rng(7)
    links = iter([from_pseudo_inertia(a @ a.T) for a in rng.normal(size=(robot.dof, 4, 4))])
    delta: list[float] = []
    for parameter in standard_parameters(robot, terms):
        if parameter.kind != "inertial":
            delta.append(rng.uniform(0.1, 2))
        elif parameter.name.endswith("xx"):
            delta.extend(next(links))
    return Model(
        arm=robot.model.name,
        estimator="feasible",
        robot=robot,
        terms=terms,
        delta=np.array(delta),
        moving=np.ones(robot.dof, dtype=bool),
        base_parameters=(),
        filter=Filter(1.0, 3, 10.0, 10.0, True, 0.01),
        noise=np.ones(robot.dof),
        logs=("a.mcap",),
    )


def crane(**zero: bool) -> Model:
    """Two joints of three, one of them prismatic; gravity is not along z."""
    robot = load_robot(SLIDER, ("slew", "reach"), gravity_m_s2=(1.0, -2.0, -9.0))
    return identified(robot, np.eye(2), **zero)


def mast(**zero: bool) -> Model:
    """A single joint, as of a servo on a test bench."""
    return identified(load_robot(SLIDER, ("slew",)), np.eye(1), **zero)


def states(model: Model) -> list[NDArray]:
    rng = np.random.default_rng(8)
    return list(rng.uniform(-3, 3, size=(3, STATES, model.robot.dof)))


def coulomb(model: Model, qd: NDArray) -> NDArray:
    """Coulomb torque, which MuJoCo smooths and Pinocchio leaves to the user."""
    return with_zero(model, "fc", "fcm", keep=True).inverse_dynamics(0 * qd, qd, 0 * qd)


def with_zero(model: Model, *kinds: str, keep: bool = False) -> Model:
    """The model without these kinds of parameters, or (`keep`) with nothing else."""
    chosen = np.array([(p.kind in kinds) == keep for p in model.parameters])
    return replace(model, delta=np.where(chosen, model.delta, 0.0))


def mujoco_torque(text: str, q: NDArray, qd: NDArray, qdd: NDArray) -> NDArray:
    model = mujoco.MjModel.from_xml_string(text)  # pyright: ignore[reportAttributeAccessIssue]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS  # pyright: ignore
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT  # pyright: ignore
    data = mujoco.MjData(model)  # pyright: ignore
    torque, pulls = np.empty_like(q), []
    for k in range(q.shape[1]):
        data.ctrl[:] = np.arange(model.nu) == k
        mujoco.mj_forward(model, data)  # pyright: ignore
        pulls.append(data.qfrc_actuator.copy())
    data.ctrl[:] = 0.0
    mujoco.mj_forward(model, data)  # pyright: ignore
    moments = np.column_stack(pulls) - data.qfrc_actuator[:, None]
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)  # pyright: ignore
        mujoco.mj_fwdActuation(model, data)  # pyright: ignore
        torque[k] = np.linalg.solve(moments, data.qfrc_inverse - data.qfrc_actuator)
    return torque


def relative(one: NDArray, other: NDArray) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())


def whole_wam(**zero: bool) -> Model:
    return identified(*wam(), **zero)


@pytest.mark.parametrize("arm", [whole_wam, crane, mast])
def test_urdf_gives_the_same_torque_in_pinocchio(arm: Callable[..., Model]) -> None:
    model = arm(offset=False, rotor_inertia=False, motor_friction=False)
    loaded = pin.buildModelFromXML(to_urdf(model))
    assert tuple(n for n in loaded.names if n != "universe") == model.robot.joint_names
    loaded.gravity = model.robot.model.gravity
    data = loaded.createData()
    q, qd, qdd = states(model)
    rows = zip(q, qd, qdd, strict=True)
    torque = np.array([pin.rnea(loaded, data, *row).copy() for row in rows])
    torque += qd * loaded.damping + np.sign(qd) * loaded.friction
    assert relative(torque, model.inverse_dynamics(q, qd, qdd)) < 1e-9


@pytest.mark.parametrize("arm", [whole_wam, crane, mast])
def test_mjcf_gives_the_same_torque_in_mujoco(arm: Callable[..., Model]) -> None:
    model = arm()
    q, qd, qdd = states(model)
    torque = mujoco_torque(to_mjcf(model), q, qd, qdd) + coulomb(model, qd)
    assert relative(torque, model.inverse_dynamics(q, qd, qdd)) < 1e-9


def test_mjcf_holds_coulomb_friction() -> None:
    model = identified(*wam(), offset=False)
    loaded = mujoco.MjModel.from_xml_string(to_mjcf(model))  # pyright: ignore
    np.testing.assert_array_equal(loaded.dof_frictionloss, model.parameter("fc"))
    coupled = [m - 1 for m in model.terms.coupled_motors]
    assert coupled == [1, 2, 4, 5]
    np.testing.assert_array_equal(loaded.tendon_frictionloss, model.parameter("fcm")[coupled])
    assert [loaded.joint(k).name for k in range(7)] == list(model.robot.joint_names)
    np.testing.assert_array_equal(loaded.jnt_range[:, 0], model.robot.model.lowerPositionLimit)
    np.testing.assert_array_equal(loaded.actuator_ctrlrange[:, 1], model.robot.model.effortLimit)


def test_a_simulated_step_in_mujoco_follows_the_model() -> None:
    """Forward and inverse dynamics of the exported arm are one another's inverse."""
    model = with_zero(identified(*wam(), offset=False), "fc", "fcm")
    loaded = mujoco.MjModel.from_xml_string(to_mjcf(model))  # pyright: ignore
    data = mujoco.MjData(loaded)  # pyright: ignore
    q, qd, qdd = (0.1 * rows[0] for rows in states(model))
    data.qpos[:], data.qvel[:] = q, qd
    data.qfrc_applied[:] = model.inverse_dynamics(q, qd, qdd)
    mujoco.mj_forward(loaded, data)  # pyright: ignore
    np.testing.assert_allclose(data.qacc, qdd, atol=1e-9)


def test_what_has_no_place_is_said() -> None:
    model = replace(crane(), effects=bound((STRIBECK, RIPPLE)), moving=np.array([True, False]))
    said = left_out_of_urdf(model)
    assert [re.sub(r"\([\d.e+]+ N m rms\)", "(x N m)", words) for words in said] == [
        "left out, since URDF has no place for it: rotor inertia (x N m), torque offset (x N m),"
        " effect stribeck of slew (x N m), effect torque_ripple of slew (x N m)",
        "gravity is not along -z: set it to 1.0 -2.0 -9.0 m/s^2",
        "held in the recordings, so not identified: reach",
    ]
    (left,) = left_out_of_mjcf(model)[:-1]
    assert left.startswith(
        "left out, since MJCF has no place for it: effect torque_ripple of slew ("
    )
    assert 0.1 < float(left.split("(")[1].split()[0]) < 1.5  # rms of what is at most 1.5 N m
    whole = crane(offset=False, rotor_inertia=False, motor_friction=False)
    assert left_out_of_mjcf(whole) == []


def test_an_impossible_model_is_refused() -> None:
    model = replace(crane(), estimator="ols")
    delta = model.delta.copy()
    delta[[p.name == "m2" for p in model.parameters]] = -1.0
    with pytest.raises(DataError) as caught:
        to_urdf(replace(model, delta=delta))
    start, end = str(caught.value).split("eigenvalue ")
    assert start == (
        "The ols model of crane cannot be exported: the link of reach has a pseudo-inertia"
        " with the "
    )
    assert end.endswith(", and no mass distribution has one below 0; export the feasible model.")


def test_the_command(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(export)
    path, out = tmp_path / "model.yaml", tmp_path / "arm.xml"
    crane().save(path)
    result = CliRunner().invoke(app, [str(path), "--to", "mjcf", "--out", str(out)])
    assert result.exit_code == 0
    assert result.stdout == f"{out}\n"
    assert result.stderr.startswith("Next: the same with --force --replay LOG.mcap")
    assert mujoco.MjModel.from_xml_path(str(out)).nq == 2  # pyright: ignore
    urdf = CliRunner().invoke(app, [str(path), "--to", "urdf", "--out", str(tmp_path / "a.urdf")])
    assert (
        "Next" not in urdf.stderr
    )  # an impossible one is refused; its masses are as the data tell
    missing = tmp_path / "no" / "arm.urdf"
    result = CliRunner().invoke(app, [str(path), "--to", "urdf", "--out", str(missing)])
    assert str(result.exception) == (
        f"{missing} cannot be written (there is no folder {missing.parent}): make it, or name"
        " another file with --out."
    )
