"""`ident run` and `ident validate` from files to files, and one sentence for what is wrong."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from ident import load_model
from ident.cli import main
from ident.recordings.loading import Reading
from ident.workflows.run import run_logs
from wamctl.arm.config import shipped_file
from wamctl.arm.recorder import Recorder
from wamctl.arm.robot import inverse_dynamics as rigid_torque
from wamctl.arm.robot import with_parameters

ATTACHED = {
    name: shipped_file(f).read_bytes()
    for name, f in (("config.yaml", "wam7.yaml"), ("robot.urdf", "wam7.urdf"))
}


def write_log(path: Path, recording, attachments=ATTACHED, effort=True) -> Path:
    with Recorder(path, recording.joint_names, {}, attachments) as log:
        for stamp, q, tau in zip(recording.stamp_ns, recording.q, recording.effort, strict=True):
            log.joint_states(int(stamp), q, None, tau if effort else None)
    return path


def call(*arguments: object) -> int:
    """Exit status of a command."""
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    return ended.value.code or 0


@pytest.fixture(scope="module")
def log(tmp_path_factory, noisy) -> Path:
    return write_log(tmp_path_factory.mktemp("logs") / "log.mcap", noisy)


@pytest.fixture(scope="module")
def results(log) -> Path:
    out = log.parent / "identified"
    assert call("run", log, "--out", out) == 0
    return out


def test_run_writes_what_the_contract_lists(results):
    assert sorted(p.name for p in results.iterdir()) == ["model.yaml", "report.html", "run.json"]
    content = json.loads((results / "run.json").read_text())
    assert (content["samples"], content["sample_rate_hz"], content["rank"]) == (5000, 250.0, 57)
    assert content["cutoff_hz"] == pytest.approx(2.5)
    assert content["velocity_threshold"] == 0.01
    assert {"cad", "ols", "wls", "feasible"} <= set(content["estimators"])
    feasible = content["estimators"]["feasible"]
    assert feasible["feasible"] is True
    assert feasible["min_pseudo_inertia_eigenvalue"] > 0
    assert feasible["mass_matrix_positive_fraction"] == 1.0
    assert len(feasible["relative_error_percent_by_joint"]) == 7
    row = content["base_parameters"][0]
    assert set(row) == {"name", "cad", "ols", "sd", "feasible", "unit"}
    assert (row["name"], row["unit"]) == ("L1yy + L2zz", "kg m^2")
    assert content["base_parameters"][1]["cad"] is None  # fv1
    assert content["solver"]["name"] == "Clarabel"
    steps = {"read", "filter", "regressor", "solve", "report", "total"}
    assert set(content["seconds"]) == steps
    assert set(content["active_constraints"][0]) >= {"joint", "constraint", "multiplier"}


def test_json_goes_to_stdout(log, tmp_path, capsys):
    assert call("run", log, "--out", tmp_path / "out", "--json") == 0
    assert json.loads(capsys.readouterr().out)["rank"] == 57


def test_steps_are_told_as_they_begin(log, tmp_path):
    said: dict[str, list[float]] = {}

    def tell(what: str, share: float | None = None) -> None:
        said.setdefault(what, []).extend([] if share is None else [share])

    run_logs([log], None, tmp_path / "out", Reading(), tell)
    reducing = "filtering and reducing 5000 samples"
    assert list(said) == [
        "reading",
        "checking the recordings",
        reducing,
        "trying further terms: torque offset and rotor inertia",
        "fitting, and predicting what was not fitted",
        "writing the report",
    ]
    assert said[reducing] == sorted(said[reducing])
    assert 0.9 < said[reducing][-1] <= 1.0


def test_effects_of_another_arm_are_refused(results, log, tmp_path, capsys):
    other = tmp_path / "other.yaml"
    text = (results / "model.yaml").read_text()
    joint = load_model(results / "model.yaml").robot.joint_names[0]
    other.write_text(text.replace(joint, "another_joint"))
    assert call("run", log, "--effects", other, "--out", tmp_path / "out") == 6
    assert "joints are not those of the recordings" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_without_effects_nothing_is_taken_off(results, log, tmp_path):
    plain = results / "model.yaml"
    assert call("run", log, "--effects", plain, "--out", tmp_path / "out") == 0
    motion = np.random.default_rng(0).uniform(-1, 1, (3, 40, 7))
    models = [load_model(p) for p in (plain, tmp_path / "out" / "model.yaml")]
    before, after = (model.inverse_dynamics(*motion) for model in models)
    assert np.linalg.norm(after - before) < 0.02 * np.linalg.norm(before)


def test_what_is_left_to_do_is_told_for_all_logs_together(log, tmp_path):
    shares = []

    def tell(what: str, share: float | None = None) -> None:
        shares.extend([] if share is None else [share])

    run_logs([log, log], None, tmp_path / "out", Reading(), tell)
    assert shares == sorted(shares)
    assert shares[0] < 0.55
    assert shares[-1] > 0.9


def test_the_model_predicts_the_torque(results, wam, noisy):
    model = load_model(results / "model.yaml")
    assert model.arm == "wam7"
    q, qd, qdd = np.random.default_rng(0).uniform(-1, 1, (3, 40, 7))
    torque = model.inverse_dynamics(q, qd, qdd)
    links = with_parameters(model.robot, model.inertial)
    by_hand = rigid_torque(links, q, qd, qdd)
    by_hand += model.parameter("fv") * qd + model.parameter("fc") * np.sign(qd)
    np.testing.assert_allclose(torque, by_hand, atol=1e-9)
    np.testing.assert_allclose(model.inverse_dynamics(q[0], qd[0], qdd[0]), torque[0])
    truth = wam.torque(q, qd, qdd)
    assert np.linalg.norm(torque - truth) < 0.05 * np.linalg.norm(truth)
    names = [b.name for b in model.base_parameters]
    assert names[4:6] == ["L2xy", "L2xz"]
    assert set(model.base_parameters[4].values) == {"cad", "ols", "wls", "feasible"}


def test_validate_gives_the_errors_of_the_fit_on_its_own_log(results, log, tmp_path, capsys):
    out = tmp_path / "validated"
    assert call("validate", log, "--model", results / "model.yaml", "--out", out) == 0
    said = capsys.readouterr().out
    assert "relative torque error" in said
    assert "The model was fitted on log.mcap: its error there says little." in said
    (found,) = json.loads((out / "validate.json").read_text())["logs"]
    fitted = json.loads((results / "run.json").read_text())["estimators"]
    for name, errors in fitted.items():
        assert found["estimators"][name]["mse"] == pytest.approx(errors["mse"], rel=1e-6), name
    assert found["relative_error_percent"] == pytest.approx(
        fitted["feasible"]["relative_error_percent"], rel=1e-6
    )


def test_settings_can_be_changed_on_the_command_line(log, tmp_path):
    out = tmp_path / "out"
    changes = ["terms=viscous,coulomb,offset", "velocity_threshold_rad_s=auto"]
    options = [x for c in changes for x in ("--set", c)]
    assert call("run", log, "--out", out, "--cutoff", "4", *options) == 0
    content = json.loads((out / "run.json").read_text())
    assert content["rank"] == 64
    assert content["cutoff_hz"] == 4.0
    names = [b["name"] for b in content["base_parameters"]]
    assert "fo7" in names


def test_several_logs_are_fitted_together(log, tmp_path, noisy):
    other = write_log(tmp_path / "other.mcap", noisy)
    out = tmp_path / "out"
    assert call("run", log, other, "--out", out) == 0
    assert json.loads((out / "run.json").read_text())["samples"] == 10_000


def test_a_robot_file_replaces_what_the_log_carries(tmp_path, noisy):
    bare = write_log(tmp_path / "bare.mcap", noisy, {})
    assert call("run", bare, "--robot", "wam7.yaml", "--out", tmp_path / "a") == 0
    urdf = tmp_path / "arm.urdf"
    urdf.write_bytes(ATTACHED["robot.urdf"])
    assert call("run", bare, "--robot", urdf, "--out", tmp_path / "b") == 0
    content = json.loads((tmp_path / "b" / "run.json").read_text())
    assert content["rank"] == 57
    assert content["cutoff_from"].startswith("10 times the frequency below which 99%")


def refused(capsys, out: Path, status: int, *arguments: object) -> str:
    """The one sentence of a command that must fail and write nothing."""
    assert call(*arguments, "--out", out) == status
    captured = capsys.readouterr()
    assert captured.out == ""
    assert not out.exists() or not list(out.iterdir())
    assert captured.err.count("\n") == 1
    return captured.err.strip()


def test_a_missing_log(tmp_path, capsys):
    said = refused(capsys, tmp_path / "out", 6, "run", tmp_path / "none.mcap")
    advice = "give an .mcap or .db3 file, or a bag's folder."
    assert said == f"ident: {tmp_path}/none.mcap does not exist: {advice}"


def test_an_empty_log(tmp_path, capsys):
    empty = tmp_path / "empty.mcap"
    empty.touch()
    said = refused(capsys, tmp_path / "out", 6, "run", empty)
    assert said == f"ident: {empty} is empty (0 bytes)."


def test_a_log_without_its_arm(tmp_path, noisy, capsys):
    bare = write_log(tmp_path / "bare.mcap", noisy, {})
    said = refused(capsys, tmp_path / "out", 6, "run", bare)
    assert said == (
        f"ident: {bare} carries no robot.urdf: name the arm with --robot FILE.yaml or .urdf."
    )


def test_a_log_without_torque(tmp_path, noisy, capsys):
    silent = write_log(tmp_path / "silent.mcap", noisy, effort=False)
    said = refused(capsys, tmp_path / "out", 6, "run", silent)
    assert said.startswith(f"ident: {silent} holds no joint torque: /joint_states has ")


def test_a_log_of_another_arm(log, tmp_path, capsys):
    text = ATTACHED["config.yaml"].decode().replace("wam/palm_yaw_joint", "wam/hand_joint")
    urdf = ATTACHED["robot.urdf"].decode().replace("wam/palm_yaw_joint", "wam/hand_joint")
    (tmp_path / "wam7.urdf").write_text(urdf)
    (tmp_path / "other.yaml").write_text(text)
    shutil.copy(shipped_file("puck4.eds"), tmp_path)
    said = refused(capsys, tmp_path / "out", 6, "run", log, "--robot", tmp_path / "other.yaml")
    assert said.startswith(f"ident: {log} has no joint 'wam/hand_joint'; its joints are wam/base")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda c: c | {"speed": 1}, "speed: unknown key."),
        (lambda c: c["identification"].update(filter_order=-1) or c,
         "identification.filter_order: -1 should be greater than or equal to 1."),
    ],
)  # fmt: skip
def test_faults_of_the_robot_file(log, tmp_path, capsys, change, sentence):
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(change(yaml.safe_load(ATTACHED["config.yaml"]))))
    said = refused(capsys, tmp_path / "out", 3, "run", log, "--robot", path)
    assert said == f"ident: {path}: {sentence}"


def test_broken_yaml(log, tmp_path, capsys):
    path = tmp_path / "arm.yaml"
    path.write_text("arm: [wam7\nrobot: x")
    said = refused(capsys, tmp_path / "out", 3, "run", log, "--robot", path)
    assert said.startswith(f"ident: {path}: not valid YAML in line 2, column ")


def test_unknown_settings(log, tmp_path, capsys):
    said = refused(capsys, tmp_path / "out", 3, "run", log, "--set", "cutof_hz=3")
    assert said.startswith(
        "ident: --set: 'cutof_hz=3' is not NAME=VALUE with a NAME of cad_spread,"
    )
    said = refused(capsys, tmp_path / "out", 3, "run", log, "--cutoff", "-2")
    assert said == "ident: settings: cutoff_hz: -2.0 should be greater than 0."


def test_a_log_cut_in_the_middle_of_a_chunk_gives_what_was_whole(log, tmp_path):
    cut = tmp_path / "cut.mcap"
    data = log.read_bytes()
    cut.write_bytes(data[: int(0.7 * len(data))])
    assert call("run", cut, "--out", tmp_path / "out") == 0
    samples = json.loads((tmp_path / "out" / "run.json").read_text())["samples"]
    assert 3000 < samples < 3600


def test_a_folder_that_cannot_be_written(log, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert call("run", log, "--out", tmp_path / "file" / "out") == 6
    assert "cannot be written" in capsys.readouterr().err


def test_models_that_cannot_be_used(results, log, tmp_path, capsys):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("format: other\n")
    said = refused(capsys, tmp_path / "out", 6, "validate", log, "--model", wrong)
    advice = "give the model.yaml that `ident run` or `ident gap` wrote."
    assert said == f"ident: {wrong} is not a model: {advice}"
    content = yaml.safe_load((results / "model.yaml").read_text())
    wrong.write_text(yaml.safe_dump(content | {"version": 9}))
    said = refused(capsys, tmp_path / "out", 6, "validate", log, "--model", wrong)
    assert said == f"ident: {wrong} has version 9, and this program reads up to 1: update it."
    content["moving"][3] = False
    wrong.write_text(yaml.safe_dump(content))
    said = refused(capsys, tmp_path / "out", 6, "validate", log, "--model", wrong)
    assert said == (
        f"ident: {log} moves wam/elbow_pitch_joint, held in the recordings that the model was"
        " fitted on: fit recordings that move it as well, or give one that does not."
    )
