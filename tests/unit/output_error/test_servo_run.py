import json
import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import yaml
from servo_arm import ARMATURE, COULOMB, DAMPING, JOINTS, STIFFNESS, URDF, recording
from typer.testing import CliRunner

import ident
from ident.cli import app
from ident.export.servos import servo_mjcf, servo_replay
from ident.output_error.parameters import ROW
from ident.output_error.recordings import segments_of
from ident.output_error.servo_model import load_servos
from ident.recordings.loading import Reading
from ident.report.servos.run_page import error_sentence
from ident.workflows.method import method_for
from wamctl.arm.errors import DataError
from wamctl.arm.recorder import write_recording


def test_method_is_chosen_where_no_torque_is_and_said(identified):
    content = json.loads((identified / "run.json").read_text())
    assert content["method"] == "simulation"
    assert "no_torque" in [r["code"] for r in content["remarks"]]
    assert content["verdict"] == "trustworthy"
    said = (identified / "said.txt").read_text(encoding="utf-8")
    assert re.search(r"[\d.]+ mrad on stretches of time that are left out\.\n", said)


def test_settings_of_another_simulator_are_recovered(identified):
    content = json.loads((identified / "run.json").read_text())
    found = {(p["name"], p["joint"]): p["value"] for p in content["parameters"]}
    truth = {
        "stiffness": STIFFNESS, "damping": DAMPING, "coulomb": COULOMB, "armature": ARMATURE,
        "delay": 0.015,
    }  # fmt: skip
    for name, value in truth.items():
        for joint in (1, 2):
            assert found[name, joint] == pytest.approx(value, rel=0.15), (name, joint)
    kept = {t["name"] for t in content["parts_tried"] if any(t["kept"])}
    assert not kept & {"half_play", "compliance", "profile", "integral", "dead_zone"}


def test_validate_replays_other_motions(identified, logs, tmp_path):
    done = CliRunner().invoke(
        app,
        ["validate", str(logs[1]), "--model", str(identified / "model.yaml"), "--out",
         str(tmp_path)],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    (log,) = json.loads((tmp_path / "validate.json").read_text())["logs"]
    step = 2 * np.pi / 4096
    assert max(log["rms_q_by_joint"]) < 2 * step
    assert min(log["following_rms_by_joint"]) > 20 * step


def test_exports_open_where_they_are_for(identified, logs, tmp_path):
    arm, settings = tmp_path / "arm.xml", tmp_path / "servos.yaml"
    model = str(identified / "model.yaml")
    done = CliRunner().invoke(
        app,
        ["export", model, "--to", "mjcf", "--out", str(arm), "--replay", str(logs[1]), "--json"],
    )
    assert done.exit_code == 0, done.output
    errors = json.loads(done.output)["replay_rms_rad"]
    assert max(errors["mujoco"]) < 0.005
    loaded = mujoco.MjModel.from_xml_path(str(arm))
    assert loaded.nu == 2
    assert loaded.dof_frictionloss == pytest.approx([COULOMB] * 2, rel=0.15)
    done = CliRunner().invoke(app, ["export", model, "--to", "isaaclab", "--out", str(settings)])
    assert done.exit_code == 0, done.output
    servos = yaml.safe_load(settings.read_text())["servos"]
    assert list(servos["stiffness"]) == list(JOINTS)


def test_a_replay_is_read_when_the_recording_was(identified):
    """Between two steps of MuJoCo lies the middle of what it passes, not the later one."""
    model = load_servos(identified / "model.yaml")
    (segment,) = segments_of(recording(3.0), JOINTS, "log")
    t = np.sort(np.concatenate([segment.motion.t[:100] + 0.001 * k for k in range(3)]))
    finer = replace(segment, motion=segment.motion._replace(t=t), q=np.zeros((len(t), 2)))
    (made,) = servo_replay(servo_mjcf(model), model, [finer])
    before, between, after = made.mujoco[0::3], made.mujoco[1::3], made.mujoco[2::3]
    assert between == pytest.approx((before + after) / 2, abs=1e-6)
    assert np.abs(after - between).max() > 1e-4


def test_a_replay_holds_what_is_fed_forward(identified):
    """Its commands are further ahead by the torque that holds the links' weight."""
    model = load_servos(identified / "model.yaml")
    (segment,) = segments_of(recording(6.0, fed_forward=1.0), JOINTS, "log")
    settings = model.settings.copy()
    settings[ROW["gravity_gain"]] = 1.0
    errors = []
    for each in (model, replace(model, settings=settings)):
        (made,) = servo_replay(servo_mjcf(each), each, [segment])
        errors.append(np.sqrt(np.mean((made.mujoco - segment.q) ** 2)))
    assert errors[1] < 0.005 < 0.03 < errors[0]


def test_python_gives_the_same(logs):
    arm = ident.Arm.from_urdf(URDF)
    rec = ident.Recording.from_bag(logs[0])
    assert rec.tau is None
    with pytest.raises(DataError, match="torque"):
        ident.identify(arm, rec)


def test_python_reads_and_exports_what_was_written(identified, tmp_path):
    model = ident.load_servos(identified / "model.yaml")
    assert ident.export_model(model, tmp_path / "arm.xml", "mjcf")
    assert (tmp_path / "arm.xml").read_text().startswith("<")
    with pytest.raises(DataError, match="no format of an export; there are mjcf, isaaclab"):
        ident.export_model(model, tmp_path / "arm.urdf")
    with pytest.raises(DataError, match=r"ident\.load_servos"):
        ident.load_model(identified / "model.yaml")


def test_effort_without_sign_is_left_aside(tmp_path):
    made = recording(4.0)
    load = np.abs(np.random.default_rng(0).normal(size=made.q.shape))
    write_recording(tmp_path / "unsigned.mcap", replace(made, effort=load))
    method, (remark,) = method_for([tmp_path / "unsigned.mcap"], None, Reading())
    assert method == "simulation"
    assert "no sign" in remark.sentence
    write_recording(tmp_path / "signed.mcap", replace(made, effort=load - 1.0))
    assert method_for([tmp_path / "signed.mcap"], None, Reading()) == ("regression", [])


def test_effort_that_lost_its_sign_in_sixteen_bits_is_told(tmp_path):
    made = recording(4.0)
    load = np.round(np.random.default_rng(0).normal(0.0, 300.0, size=made.q.shape))
    write_recording(tmp_path / "wrapped.mcap", replace(made, effort=1e-3 * (load % 2**16)))
    method, (remark,) = method_for([tmp_path / "wrapped.mcap"], None, Reading())
    assert method == "simulation"
    assert "65536" in remark.sentence


def test_a_loop_that_commands_torque_is_no_servo():
    """Its simulation takes minutes, and follows the recording no better than the command does."""
    inside = {"config.yaml": b"robot: {}\ncontroller:\n  damping_ratio: 1.0\n"}
    with pytest.raises(DataError, match="commands torque"):
        segments_of(replace(recording(4.0), attachments=inside), JOINTS, "log.mcap")


def test_settings_of_the_regression_are_refused(logs, tmp_path):
    done = CliRunner().invoke(
        app, ["run", str(logs[0]), "--cutoff", "5", "--out", str(tmp_path / "no")]
    )
    assert done.exit_code == 3 or "belongs to the regression" in str(done.exception)


def test_joints_that_are_held_do_not_count_in_the_headline():
    content = {
        "moving": [True, False],
        "rms_q_by_joint": [0.002, 0.5],
        "held_out": {"rms_q_by_joint": [0.003, 0.5]},
    }
    assert error_sentence(content).endswith(
        "the arm is 2.00 mrad (rms over the joints that move) from where it was measured, and"
        " 3.00 mrad on stretches of time that are left out."
    )
