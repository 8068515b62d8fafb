"""An arm that is no WAM, simulated by MuJoCo: from its URDF and its bag to a report.

It slides at one joint, leans, and has a gripper whose fingers mimic each other.
"""

import json
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from ident.cli import main
from wamctl.arm.recording import read_recording

SCRIPT = Path(__file__).parents[2] / "scripts/examples/mujoco_recording.py"

PICKER = """<robot name="picker">
  <link name="base"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="1.2 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="3" effort="80"/></joint>
  <link name="upper"><inertial><origin xyz="0.2 0.01 0.02"/><mass value="6"/>
    <inertia ixx="0.02" iyy="0.11" izz="0.12" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.4" upper="2.4" velocity="4" effort="40"/></joint>
  <link name="lower"><inertial><origin xyz="0.15 0 0.03"/><mass value="4"/>
    <inertia ixx="0.01" iyy="0.05" izz="0.055" ixy="0" ixz="0.002" iyz="0"/></inertial></link>
  <joint name="reach" type="prismatic"><parent link="lower"/><child link="quill"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 0 -1"/>
    <limit lower="0" upper="0.4" velocity="1" effort="120"/></joint>
  <link name="quill"><inertial><origin xyz="0 0.01 -0.1"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="roll" type="continuous"><parent link="quill"/><child link="hand"/>
    <origin xyz="0 0 -0.2"/><axis xyz="0 0 -1"/><limit velocity="6" effort="8"/></joint>
  <link name="hand"><inertial><origin xyz="0.03 0 -0.05"/><mass value="1"/>
    <inertia ixx="0.004" iyy="0.003" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="left" type="prismatic"><parent link="hand"/><child link="left_finger"/>
    <origin xyz="0 0 -0.1"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" velocity="0.2" effort="20"/></joint>
  <link name="left_finger"><inertial><mass value="0.05"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="right" type="prismatic"><parent link="hand"/><child link="right_finger"/>
    <origin xyz="0 0 -0.1"/><axis xyz="0 -1 0"/><mimic joint="left"/>
    <limit lower="0" upper="0.04" velocity="0.2" effort="20"/></joint>
  <link name="right_finger"><inertial><mass value="0.05"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""

DRIVEN = ["turn", "bend", "reach", "roll"]


def loaded_script():
    spec = spec_from_file_location(SCRIPT.stem, SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[SCRIPT.stem] = module
    spec.loader.exec_module(module)
    return module


def typed(*arguments: object) -> None:
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    assert not ended.value.code


@pytest.fixture(scope="module")
def flow(tmp_path_factory) -> tuple[dict, dict, dict[str, np.ndarray]]:
    """Content of run.json and validate.json, and the true friction and rotors by joint."""
    folder, script = tmp_path_factory.mktemp("picker"), loaded_script()
    urdf = folder / "picker.urdf"
    urdf.write_text(PICKER)
    options = ["--seconds", "30", "--arm-seed", "3"]
    script.main([str(urdf), str(folder / "first"), *options])
    script.main([str(urdf), str(folder / "second"), *options, "--seed", "1", "--sqlite"])
    terms = ["--set", "terms=viscous,coulomb,auto"]
    typed("run", folder / "first", "--robot", urdf, *terms, "--out", folder / "model")
    model = folder / "model" / "model.yaml"
    typed("validate", folder / "second", "--model", model, "--out", folder / "seen")
    root = ElementTree.fromstring(PICKER)
    arm = script.arm_of(root, script.driven_joints(root), np.random.default_rng(3))
    truth = {"fc": arm.dof_frictionloss, "fv": arm.dof_damping, "ia": arm.dof_armature}
    run = json.loads((folder / "model" / "run.json").read_text())
    return run, json.loads((folder / "seen" / "validate.json").read_text()), truth


def test_joints_that_move_by_themselves_are_the_model_s(flow):
    run, _, _ = flow
    assert run["joints"] == DRIVEN
    assert run["logs"][0]["remarks"] == ["recorded, but no joints of the model: left, right"]


def test_units_are_those_of_turning_and_sliding_joints(flow):
    run, _, _ = flow
    units = {p["name"]: p["unit"] for p in run["base_parameters"]}
    assert (units["fc2"], units["fv2"], units["ia2"]) == ("N m", "N m s/rad", "kg m^2")
    assert (units["fc3"], units["fv3"], units["ia3"]) == ("N", "N s/m", "kg")
    assert run["torque_units"] == ["N m", "N m", "N", "N m"]


def test_friction_and_rotors_are_mujoco_s(flow):
    run, _, truth = flow
    found = {p["name"]: p for p in run["base_parameters"]}
    alone = [f"{kind}{k}" for kind in truth for k in range(1, 5) if f"{kind}{k}" in found]
    assert len(alone) == 11  # the first joint's rotor turns about the axis of its link
    for name in alone:
        expected = truth[name[:2]][int(name[2:]) - 1]
        reached = 4 * found[name]["sd"] + 0.01 * expected
        assert found[name]["feasible"] == pytest.approx(expected, abs=reached), name


def test_a_gripper_s_driver_may_share_the_topic(flow, tmp_path):
    """Both drivers' messages stand in one topic, the gripper's first."""
    run, _, _ = flow
    script = loaded_script()
    whole = read_recording(run["logs"][0]["name"])
    columns = {"arm": slice(0, 4), "gripper": slice(4, 6)}
    arm, gripper = (
        script.Recorded(
            whole.joint_names[c], whole.stamp_ns, whole.q[:, c], whole.qd[:, c], whole.effort[:, c]
        )
        for c in columns.values()
    )
    bag, urdf = tmp_path / "both", tmp_path / "picker.urdf"
    urdf.write_text(PICKER)
    script.write_bag(bag, [gripper, arm], StoragePlugin.MCAP)
    terms = ["--set", "terms=viscous,coulomb,auto"]
    typed("run", bag, "--robot", urdf, *terms, "--out", tmp_path / "model")
    found = json.loads((tmp_path / "model" / "run.json").read_text())
    assert found["joints"] == DRIVEN
    assert found["base_parameters"] == run["base_parameters"]


def test_a_joint_that_was_not_recorded_is_told(flow, tmp_path, capsys):
    run, _, _ = flow
    urdf = tmp_path / "picker.urdf"
    urdf.write_text(PICKER.replace('"roll"', '"twist"'))
    typed("run", run["logs"][0]["name"], "--robot", urdf, "--out", tmp_path / "model")
    said = capsys.readouterr().err.replace(run["logs"][0]["name"], "bag").splitlines()
    assert said[:2] == [
        "bag: recorded, but no joints of the model: roll, left, right.",
        "bag: joints of the URDF, but not recorded, so locked at zero: twist.",
    ]


def test_another_motion_is_predicted(flow):
    run, seen, _ = flow
    as_described = run["estimators"]["cad"]["relative_error_percent"]
    assert seen["logs"][0]["relative_error_percent"] < min(1.0, as_described / 10)
