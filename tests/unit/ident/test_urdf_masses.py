"""`ident check-urdf` with a recording: masses that it contradicts, and by how much."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from test_ident_commands import call, write_log

from ident.urdf_check.masses import selected
from wamctl.arm.config import shipped_file

URDF = shipped_file("wam7.urdf").read_text("utf-8")
MASSES = {4: "2.40016804", 6: "0.41797364"}


def heavier(tmp_path: Path, factor: float, *joints: int) -> Path:
    text = URDF
    for joint in joints:
        assert text.count(MASSES[joint]) == 1
        text = text.replace(MASSES[joint], f"{factor * float(MASSES[joint])}")
    path = tmp_path / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory, noisy) -> Path:
    return write_log(tmp_path_factory.mktemp("logs") / "log.mcap", noisy)


def checked(capsys, urdf: Path, log: Path, *options: str, status: int = 0) -> dict:
    assert call("check-urdf", urdf, log, "--json", *options) == status
    return json.loads(capsys.readouterr().out)


def test_the_right_urdf_is_not_contradicted(tmp_path, log, capsys):
    content = checked(capsys, heavier(tmp_path, 1.0), log)
    assert content["verdict"] == "possible"
    assert content["masses"] == []
    assert 1 in content["unseen_masses"]


@pytest.mark.parametrize(("factor", "joints"), [(2.0, (4,)), (0.5, (6,)), (1.3, (4, 6))])
def test_wrong_masses_are_told_with_their_size(factor, joints, tmp_path, log, capsys):
    content = checked(capsys, heavier(tmp_path, factor, *joints), log, "--strict", status=6)
    assert {m["joint"] for m in content["masses"]} == set(joints)
    for mass in content["masses"]:
        true = float(MASSES[mass["joint"]])
        assert mass["urdf_kg"] == pytest.approx(factor * true)
        assert mass["found_kg"] == pytest.approx(true, rel=0.05)
        assert re.search(r"carries .* in the URDF", mass["sentence"])


def test_a_refused_recording(tmp_path, noisy, capsys):
    short = write_log(tmp_path / "short.mcap", noisy)
    short.write_bytes(short.read_bytes()[: len(short.read_bytes()) // 40])
    assert call("check-urdf", heavier(tmp_path, 1.0), short) == 6
    assert capsys.readouterr().err.count("\n") == 1


def test_a_urdf_without_masses_has_none_to_compare(tmp_path, log, capsys):
    bare = tmp_path / "bare.urdf"
    bare.write_text(re.sub(r"<inertial>.*?</inertial>", "", URDF, flags=re.DOTALL), "utf-8")
    out = tmp_path / "out.urdf"
    assert call("check-urdf", bare, log, "--out", out) == 0
    told = capsys.readouterr().out
    assert re.search(r"with identified links, the torque is off by \d", told)
    assert "The URDF has no masses to compare them with." in told
    assert f" {out} holds the same: nothing was repaired." in told
    content = checked(capsys, bare, log)
    assert content["masses"] == []
    errors = content["recording"]["relative_error_percent"]
    assert errors["urdf"] is None
    assert errors["identified"] < 10


def test_a_mass_that_stood_in_for_later_ones_is_not_contradicted():
    """The first link does nearly what the two others do together, which alone are wrong."""
    A = np.zeros((8, 3))
    A[:3] = 100 * np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.3, 0.0, 0.0]])
    y = A @ [0.0, 1.0, 0.6]
    alone = np.linalg.lstsq(A[:, :1], y, rcond=None)[1]
    assert all(alone < np.linalg.lstsq(A[:, [k]], y, rcond=None)[1] for k in (1, 2))
    assert sorted(selected(A, y, np.ones(3), np.full(3, True))) == [1, 2]


def with_limits(tmp_path: Path, lower: float, upper: float) -> Path:
    """The arm with other limits of its first joint."""
    path = tmp_path / "limits.urdf"
    old = re.search(r'lower="[^"]*" upper="[^"]*"', URDF)[0]
    new = f'lower="{lower}" upper="{upper}"'
    path.write_text(URDF.replace(old, new, 1), encoding="utf-8")
    return path


def limits_after(capsys, urdf: Path, log: Path) -> tuple[str, float]:
    """What is told, and the first upper limit of the repaired file."""
    out = urdf.with_name("repaired.urdf")
    call("check-urdf", urdf, log, "--out", out)
    return capsys.readouterr().out, float(re.search(r'upper="([^"]*)"', out.read_text("utf-8"))[1])


def test_limits_that_the_recording_passes_as_degrees_are_left(tmp_path, log, capsys):
    told, upper = limits_after(capsys, with_limits(tmp_path, -20, 20), log)
    assert upper == 20
    assert "are more than two turns, and no degrees either, since the recording moves it" in told
    assert "but see the doubt above" in told
    assert "exceeded the URDF's limits" not in told


def test_limits_in_degrees_that_the_recording_keeps_are_repaired(tmp_path, log, capsys):
    told, upper = limits_after(capsys, with_limits(tmp_path, -150, 150), log)
    assert upper == pytest.approx(np.radians(150))
    assert "they look like degrees" in told
    assert "holds 1 repair." in told
