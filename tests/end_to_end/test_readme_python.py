"""Python that the READMEs show runs, beside the results of their commands."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from ident.cli import main
from tests.end_to_end.stand_ins import bring_servo_logs
from wamctl.arm.config import find_file
from wamctl.arm.recorder import Recorder
from wamctl.arm.recording import Recording
from wamctl.arm.robot import inverse_dynamics, load_robot
from wamctl.arm.trajectory import read_trajectory, sample

PROJECT = Path(__file__).parents[2]


def snippets() -> dict[str, str]:
    """By README all its Python, in order."""
    listed = subprocess.run(
        ["git", "ls-files", "*README.md", "docs/*.md"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    )
    texts = {name: (PROJECT / name).read_text("utf-8") for name in listed.stdout.split()}
    blocks = {n: re.findall(r"^```python\n(.*?)^```", t, re.M | re.S) for n, t in texts.items()}
    return {name: "\n".join(found) for name, found in blocks.items() if found}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with model/model.yaml, identified from a made-up log of one period without noise."""
    place = tmp_path_factory.mktemp("readme")
    urdf = find_file("wam7.urdf").read_bytes()
    series = read_trajectory(find_file("wam7-excitation.yaml")).series
    robot = load_robot(urdf.decode())
    t = np.arange(0, series.period_s, 0.01)
    q, qd, qdd = sample(series, t)
    torque = inverse_dynamics(robot, q, qd, qdd) + 0.5 * np.sign(qd)
    attached = {"config.yaml": find_file("wam7.yaml").read_bytes(), "robot.urdf": urdf}
    with Recorder(place / "log.mcap", series.joint_names, {}, attached) as log:
        for k, instant in enumerate(t):
            log.joint_states(int(instant * 1e9), q[k], None, torque[k])
    with pytest.raises(SystemExit) as ended:
        main(["run", str(place / "log.mcap"), "--out", str(place / "model")])
    assert not ended.value.code
    bring_servo_logs(place)
    return place


def test_some_readme_shows_python() -> None:
    assert "README.md" in snippets()


@pytest.mark.parametrize("readme", snippets())
def test_the_python_of_a_readme_runs(readme, folder, monkeypatch) -> None:
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    exec(compile(snippets()[readme], readme, "exec"), names)
    if readme == "README.md":
        run, friction = names["run"], names["friction"]
        assert isinstance(run, Recording)
        assert run.q.shape == np.shape(names["error"])
        np.testing.assert_allclose(np.asarray(names["error"])[0], 0.0, atol=1e-3)
        np.testing.assert_allclose(np.asarray(friction), 0.5, atol=0.1)
