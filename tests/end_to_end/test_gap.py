"""A hidden effect through the whole path: bus, loop, log, gap, model, and simulation of it."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from ident import load_model
from ident.cli import main as ident
from wamctl.arm.recording import read_recording
from wamctl.arm.trajectory import read_trajectory, write_trajectory

FIELDS = {
    "verdict",
    "effects",
    "where",
    "not_observable",
    "held_out",
    "forward_simulation",
    "minimum_detectable",
    "detectable_units",
    "seconds",
}
HIDDEN = {
    "effect": "stribeck",
    "joints": [4],
    "extra_nm": 0.5,
    "speed_rad_s": 0.2,
    "form": "exponential",
}


def program(name: str) -> str:
    return str(Path(sys.executable).with_name(name))


def call(*arguments: object) -> int:
    """Exit status of an `ident` command."""
    with pytest.raises(SystemExit) as ended:
        ident([str(a) for a in arguments])
    return int(ended.value.code or 0)


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    """One period on a simulated arm whose elbow sticks at low speed."""
    folder = tmp_path_factory.mktemp("gap")
    (folder / "hidden.yaml").write_text(yaml.safe_dump({"effects": [HIDDEN]}))
    once = replace(read_trajectory("wam7-excitation.yaml"), periods=1)
    write_trajectory(folder / "once.yaml", once)
    excite = [program("wamctl"), "excite", "--config", "wam7.yaml", "--bus", "sim", "--lockstep"]
    excite += ["--skip-test-motion", "wam7", "--seed", "5", "--hidden", str(folder / "hidden.yaml")]
    excite += ["--trajectory", str(folder / "once.yaml"), "--out", str(folder / "log.mcap")]
    subprocess.run(excite, check=True, capture_output=True, timeout=300)
    return folder / "log.mcap"


@pytest.fixture(scope="module")
def results(log) -> Path:
    out = log.parent / "gap"
    assert call("gap", log, "--out", out, "--null-runs", 1) == 0
    return out


def test_the_hidden_effect_is_named_with_its_joint_and_size(results):
    content = json.loads((results / "gap.json").read_text())
    assert content["verdict"] == "named"
    (effect,) = content["effects"]
    assert (effect["name"], effect["joints"]) == ("stribeck", [4])
    values = effect["parameters"]
    assert values["extra_friction"]["value"] == pytest.approx(0.5, rel=0.05)
    assert values["speed"]["value"] == pytest.approx(0.2, rel=0.05)
    assert values["speed"]["unit"] == "rad/s"
    assert values["exponent"] == {"value": 1.0, "sd": 0.0, "unit": "1"}
    assert all(values[name]["sd"] > 0.0 for name in ("extra_friction", "speed"))


def test_gap_json_holds_every_field_of_the_contract(results):
    content = json.loads((results / "gap.json").read_text())
    assert set(content) >= FIELDS
    (effect,) = content["effects"]
    assert set(effect) == {
        "name",
        "joints",
        "parameters",
        "equation",
        "evidence",
        "rivals",
        "separating_experiment",
    }
    assert content["where"][0]["joint"] == 4
    assert content["where"][0]["share_of_gap"] > 0.6
    held_out = content["held_out"]
    assert {"before", "after", "noise_floor", "closed_fraction"} <= set(held_out)
    assert held_out["closed_fraction"] > 0.7
    before, after = (held_out[k]["rms_by_joint"] for k in ("before", "after"))
    assert after[3] < before[3]
    forward = content["forward_simulation"]
    assert forward["after"]["rms_q_by_joint"][3] < 0.7 * forward["before"]["rms_q_by_joint"][3]
    assert {"name": "payload", "joints": []} in content["not_observable"]
    assert content["minimum_detectable"]["stribeck"]["4"] < 0.5
    assert content["detectable_units"]["stribeck"] == "N m"
    (log,) = content["logs"]
    assert log["samples"] > 0
    assert content["seconds"] > 0.0


def test_the_report_says_it_in_a_sentence(results):
    page = (results / "report.html").read_text()
    assert "extra friction at low speed (Stribeck effect) at joint 4 (elbow pitch)" in page
    assert "Simulation against measurement" in page


def test_the_model_carries_the_effect_and_can_be_simulated(results, log):
    model = load_model(results / "model.yaml")
    assert [e.name for e in model.effects.records] == ["stribeck"]
    out = log.parent / "simulated.mcap"
    assert call("simulate", "--model", results / "model.yaml", "--out", out) == 0
    simulated, measured = read_recording(out), read_recording(log)
    assert simulated.joint_names == measured.joint_names
    assert set(simulated.attachments) >= {"config.yaml", "robot.urdf", "trajectory.yaml"}
    lag = [np.sqrt(((r.q - r.reference.q) ** 2).mean(axis=0)) for r in (simulated, measured)]
    assert lag[0] == pytest.approx(lag[1], rel=0.5)


def test_validating_the_model_counts_its_effects(results, log, capsys):
    whole = yaml.safe_load((results / "model.yaml").read_text())
    bare = log.parent / "bare.yaml"
    bare.write_text(yaml.safe_dump(whole | {"effects": []}))
    errors = []
    for model in (bare, results / "model.yaml"):
        out = log.parent / f"validated-{len(errors)}"
        assert call("validate", log, "--model", model, "--out", out) == 0
        content = json.loads((out / "validate.json").read_text())
        errors.append(content["logs"][0]["rms_by_joint"])
        assert content["effects"] == ([] if model == bare else ["stribeck"])
        asks_for_changes = f"--model {model}" in capsys.readouterr().err
        assert asks_for_changes == (model == bare and content["verdict"] == "trustworthy")
    assert errors[1][3] < errors[0][3] * 0.9  # the rest is left while the joint sticks
    assert errors[1][0] == pytest.approx(errors[0][0], rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["gap", "no.mcap"], 6, "no.mcap"),
        (["gap"], 2, "LOG"),
        (["gap", "no.mcap", "--robot", "no.yaml"], 6, "no.mcap"),
        (["simulate", "--model", "no.yaml", "--out", "o.mcap"], 3, "no.yaml"),
        (["simulate", "--out", "o.mcap"], 2, "--model"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(arguments, status, words, capsys, tmp_path):
    assert call(*arguments) == status
    assert words in capsys.readouterr().err
