"""Either protocol drives the same arm: both logs give the same model."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from wamctl.arm.config import find_file
from wamctl.arm.trajectory import FourierSeries, Trajectory, read_trajectory, write_trajectory

FUNDAMENTAL = 2.0 * np.pi / 8.0
SCALE = 0.4  # of the shipped excitation, whose accelerations grow with the fundamental


def program(name: str) -> str:
    return str(Path(sys.executable).parent / name)


def identified(folder: Path, shipped: str) -> dict[str, dict[str, float]]:
    """Base parameters of an eight-second experiment with a shipped configuration."""
    content = yaml.safe_load(find_file(shipped).read_text())
    content["robot"]["urdf"] = str(find_file("wam7.urdf"))
    if "dictionary" in content["drives"]:
        content["drives"]["dictionary"] = str(find_file("puck4.eds"))
    content["excitation"] |= {"fundamental_rad_s": float(FUNDAMENTAL), "periods": 1, "ramp_s": 1.0}
    content["excitation"]["trajectory"] = "trajectory.yaml"
    config, log = folder / shipped, folder / f"{shipped}.mcap"
    config.write_text(yaml.safe_dump(content))
    excite = ["excite", "--config", str(config), "--bus", "sim", "--lockstep", "--out", str(log)]
    excite += ["--skip-test-motion", content["arm"]]
    subprocess.run([program("wamctl"), *excite], check=True, capture_output=True, timeout=300)
    run = ["run", str(log), "--out", str(folder / "model"), "--json"]
    ident = subprocess.run(
        [program("ident"), *run], check=True, capture_output=True, text=True, timeout=300
    )
    return {p["name"]: p for p in json.loads(ident.stdout)["base_parameters"]}


@pytest.mark.thorough
def test_both_logs_give_the_same_model(tmp_path: Path) -> None:
    long = read_trajectory(find_file("wam7-excitation.yaml")).series
    short = FourierSeries(long.joint_names, FUNDAMENTAL, SCALE * long.a, SCALE * long.b, long.q0)
    write_trajectory(tmp_path / "trajectory.yaml", Trajectory(short, 1, {}, {}))
    canopen, classic = (identified(tmp_path, f) for f in ("wam7.yaml", "wam7-classic.yaml"))
    assert canopen.keys() == classic.keys()
    assert len(canopen) >= 57
    for name, one in canopen.items():
        other = classic[name]
        apart = abs(one["ols"] - other["ols"]) / np.hypot(one["sd"], other["sd"])
        assert apart < 3.0, f"{name}: {one['ols']:.6g} and {other['ols']:.6g} ({apart:.1f} sd)"
    assert any(one["ols"] != pytest.approx(classic[name]["ols"]) for name, one in canopen.items())
