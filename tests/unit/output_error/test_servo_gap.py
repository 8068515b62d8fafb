import json

import numpy as np
import pytest
from servo_arm import COULOMB, JOINTS, URDF, recording
from typer.testing import CliRunner

import ident
from ident.cli import app
from ident.output_error.servo_model import read_servo_model
from wamctl.arm.recorder import write_recording

OFFSET = -0.25  # N m at the elbow, about the friction's size


def pulled(q, v):
    return np.array([0.0, OFFSET])


@pytest.fixture(scope="module")
def gap_of_pulled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("servo_gap")
    write_recording(folder / "pulled.mcap", recording(hidden=pulled))
    done = CliRunner().invoke(
        app,
        ["gap", str(folder / "pulled.mcap"), "--method", "simulation", "--null-runs", "1",
         "--out", str(folder / "gap")],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    return folder / "gap", done.output


def test_a_torque_in_another_simulator_is_named_and_sized(gap_of_pulled):
    content = json.loads((gap_of_pulled[0] / "gap.json").read_text())
    assert content["verdict"] == "named", content["effects"]
    (effect,) = content["effects"]
    assert (effect["name"], effect["joints"]) == ("torque_offset", [2])
    # the model's offset resists, so that its sign is the other one
    size = effect["parameters"]["offset"]
    assert size["value"] == pytest.approx(-OFFSET, rel=0.1)
    held = content["held_out"]
    assert held["after"]["rms_by_joint"][1] < 0.2 * held["before"]["rms_by_joint"][1]
    assert held["closed_fraction"] > 0.9


def test_model_and_page_hold_the_effect(gap_of_pulled):
    folder, output = gap_of_pulled
    model = read_servo_model(folder / "model.yaml")
    assert model.value("offset") == pytest.approx([0.0, -OFFSET], abs=0.03)
    assert model.value("coulomb") == pytest.approx([COULOMB] * 2, rel=0.2)
    assert "misses a constant extra torque" in output
    assert "constant extra torque" in (folder / "report.html").read_text()


def gap_of(made):
    arm = ident.Arm.from_urdf(URDF)
    rec = ident.Recording(t=made.stamp_ns * 1e-9, q=made.q, q_command=made.command.q, joints=JOINTS)
    return ident.find_gap(arm, [rec], method="simulation", null_runs=1)


def test_an_effect_and_the_servos_limit_at_one_joint_do_not_hide_each_other():
    """Alone neither explains much, and both shake the shoulder, which is fitted again."""
    pushed = recording(
        16.0, 2, lambda q, v: np.array([0.0, -0.3 * abs(v[1])]), step=0.35, elbow_limit=2.5
    )
    gap = gap_of(pushed)
    assert gap.verdict == "named"
    (effect,) = gap.content["effects"]
    assert (effect["name"], effect["joints"]) == ("asymmetric_viscous", [2])
    assert effect["parameters"]["half_difference"]["value"] == pytest.approx(0.3, rel=0.1)
    assert gap.model.value("torque_limit")[1] == pytest.approx(2.5, rel=0.05)
    assert max(gap.content["held_out"]["after"]["rms_by_joint"]) < 2e-3


def test_an_arm_without_effects_misses_nothing():
    gap = gap_of(recording(seed=3))
    assert gap.verdict == "no_gap"
    assert gap.effects == ()
    assert gap.content["minimum_detectable"]["torque_offset"]["2"] < 0.1
    assert gap.content["detectable_units"]["torque_offset"] == "N m"
    assert gap.content["held_by_weight"] == [1]  # the elbow swings past the vertical
    assert "1" not in gap.content["minimum_detectable"]["backlash"]
    assert "2" in gap.content["minimum_detectable"]["backlash"]
