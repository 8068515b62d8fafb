"""The example scripts: at most fifteen lines each, and they do what their first line says."""

import json
import runpy
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from pendulum import pendulum

from ident.cli import main
from wamctl.arm.recorder import Recorder
from wamctl.arm.robot import inverse_dynamics, load_robot

SCRIPTS = Path(__file__).parents[3] / "scripts" / "examples"
SHORT = ("identify", "sweep", "name_gap", "score", "export")
SPRING, ZERO = 6.0, 0.3  # [N m/rad], [rad]


def moved(seed: int) -> tuple[np.ndarray, ...]:
    """Instants, positions and torques of a pendulum with friction, whose joint 2 has a spring."""
    robot, rng = load_robot(pendulum()), np.random.default_rng(seed)
    t = np.arange(0.0, 24.0, 0.01)
    rate = 2 * np.pi * np.arange(1, 6) / 12.0
    size, phase = rng.uniform(0.15, 0.35, (2, 5)), rng.uniform(0, 2 * np.pi, (2, 5))
    turn = t[:, None, None] * rate + phase
    q = (size * np.sin(turn)).sum(axis=2)
    qd, qdd = (size * rate * np.cos(turn)).sum(axis=2), -(size * rate**2 * np.sin(turn)).sum(axis=2)
    tau = inverse_dynamics(robot, q, qd, qdd) + 0.4 * np.tanh(qd / 0.01) + 0.2 * qd
    tau[:, 1] += SPRING * (q[:, 1] - ZERO)
    return t, q, tau + 0.02 * rng.normal(size=tau.shape)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Two logs, the first one's arrays, the URDF, and the model of the first log."""
    place = tmp_path_factory.mktemp("scripts")
    (place / "arm.urdf").write_text(pendulum())
    names = load_robot(pendulum()).joint_names
    attached = {"robot.urdf": pendulum().encode()}
    for name, seed in (("log", 1), ("other", 2)):
        t, q, tau = moved(seed)
        with Recorder(place / f"{name}.mcap", names, {}, attached) as log:
            for k, instant in enumerate(t):
                log.joint_states(round(instant * 1e9), q[k], None, tau[k])
        if name == "log":
            np.savez(place / "arrays.npz", t=t, q=q, tau=tau, joints=names)
    with pytest.raises(SystemExit):
        main(["run", str(place / "log.mcap"), "--out", str(place / "command")])
    return place


@pytest.fixture
def run(folder, monkeypatch, capsys):
    def call(name: str, *arguments: str) -> tuple[str, int]:
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        code = 0
        try:
            runpy.run_path(str(SCRIPTS / f"{name}.py"), run_name="__main__")
        except SystemExit as ended:
            code = int(ended.code or 0)
        return capsys.readouterr().out, code

    return call


@pytest.mark.parametrize("name", SHORT)
def test_at_most_fifteen_lines(name) -> None:
    lines = (SCRIPTS / f"{name}.py").read_text("utf-8").splitlines()
    assert sum(bool(line.strip()) for line in lines) <= 15


def test_identify_gives_what_the_command_gives(run, folder) -> None:
    run("identify", "arrays.npz", "arm.urdf")
    found, wanted = (
        json.loads((folder / name / "run.json").read_text())["base_parameters"]
        for name in ("model", "command")
    )
    np.testing.assert_allclose(
        [p["feasible"] for p in found], [p["feasible"] for p in wanted], rtol=1e-6, atol=1e-9
    )


def test_sweep_prints_a_line_for_each_cutoff(run) -> None:
    out, _ = run("sweep", "log.mcap", "arm.urdf", "2", "4", "8")
    assert [line.split(" Hz:")[0] for line in out.splitlines()] == ["2", "4", "8"]


def test_name_gap_names_the_spring_with_joint_and_size(run, folder) -> None:
    out, _ = run("name_gap", "log.mcap", "arm.urdf")
    assert out.startswith("named")
    (effect,) = json.loads((folder / "gap" / "gap.json").read_text())["effects"]
    assert (effect["name"], effect["joints"]) == ("joint_spring", [2])
    assert abs(effect["parameters"]["stiffness"]["value"] - SPRING) < 0.1 * SPRING


def test_score_decides_by_its_exit_code(run) -> None:
    out, code = run("score", "command/model.yaml", "other.mcap", "90")
    assert "% of the torque" in out
    assert code == 0
    assert run("score", "command/model.yaml", "other.mcap", "0.01")[1] == 1


def test_export_writes_an_arm_that_loads(run, folder) -> None:
    run("export", "command/model.yaml", "identified.urdf", "urdf")
    root = ElementTree.parse(folder / "identified.urdf").getroot()
    assert root.find("link/inertial/mass") is not None
