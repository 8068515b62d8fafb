"""The wheel holds all that the commands need outside the source tree."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    builder = Path(sys.executable).parent / "hatchling"
    subprocess.run([builder, "build", "-t", "wheel", "-d", folder], cwd=PROJECT, check=True)
    (path,) = folder.glob("*.whl")
    return path


def test_every_shipped_file_is_inside(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    tracked = subprocess.run(
        ["git", "ls-files", "configs", "wamctl", "ident", "sim_bus"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    expected = {f"wamctl/{n}" if n.startswith("configs/") else n for n in tracked}
    assert expected <= names
    top = {n.split("/")[0] for n in names if not n.split("/")[0].endswith(".dist-info")}
    assert top == {"wamctl", "ident", "sim_bus"}


def test_it_works_from_another_folder(wheel: Path, tmp_path: Path) -> None:
    installed, elsewhere = tmp_path / "installed", tmp_path / "elsewhere"
    elsewhere.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
    program = """
import sys
import ident, sim_bus, wamctl
from wamctl.arm.config import load_arm_file, shipped_file
from wamctl.arm.ros2.message_definition import definition
assert all(module.__file__.startswith(sys.argv[1]) for module in (ident, sim_bus, wamctl))
assert str(shipped_file("wam7.urdf")).startswith(sys.argv[1])
assert load_arm_file("wam7.yaml").arm == "wam7"
assert "float64[] effort" in definition("sensor_msgs/msg/JointState")
from wamctl.cli import app
from sim_bus.cli import app
from ident.cli import main
main(["import", "--help"])
"""
    result = subprocess.run(
        [sys.executable, "-c", program, str(installed)],
        cwd=elsewhere,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert "Usage: ident import" in result.stdout
    assert list(elsewhere.iterdir()) == []
