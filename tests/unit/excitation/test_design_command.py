"""`ident design` from files to files, and one sentence for what is wrong."""

import json
import webbrowser
from pathlib import Path
from typing import Any

import pytest
import yaml

from ident.cli import main
from wamctl.arm.config import find_file
from wamctl.arm.trajectory import read_trajectory

QUICK = ("--time", "0.001", "--set", "processes=1", "--set", "descents=1")


def call(*arguments: object) -> int:
    """Exit status of the command."""
    with pytest.raises(SystemExit) as ended:
        main(["design", *map(str, arguments)])
    return int(ended.value.code or 0)


def changed(tmp_path: Path, section: str, **values: Any) -> Path:
    """The WAM's file with some of its values changed."""
    content = yaml.safe_load(find_file("wam7.yaml").read_text(encoding="utf-8"))
    content[section] |= values
    if "motor_torque_nm" in values:  # the file's own bound has to stay below it
        bounds = zip(
            content["safety"]["unaccounted_torque_nm"], values["motor_torque_nm"], strict=True
        )
        content["safety"]["unaccounted_torque_nm"] = [min(u, 0.9 * m) for u, m in bounds]
    for part, name in (("robot", "urdf"), ("drives", "dictionary"), ("excitation", "trajectory")):
        content[part][name] = str(find_file(content[part][name]))
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def test_a_design_goes_on_from_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(webbrowser, "open", shown.append)
    out, start = tmp_path / "motion.yaml", find_file("wam7-excitation.yaml")
    arm = changed(tmp_path, "excitation", speed_m_s=1.0)  # which is the speed of the start
    arguments = ("--config", arm, "--start", start, "--out", out, "--view", "--json")
    assert call(*arguments, *QUICK) == 0
    arm.unlink()
    promise = json.loads(capsys.readouterr().out)
    names = ["motion-view.html", "motion.html", "motion.yaml"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
    assert shown == [(tmp_path / "motion-view.html").as_uri()]
    made, old = read_trajectory(out), read_trajectory(start)
    assert made.promise == promise
    assert promise["condition_number"] <= 1.01 * old.promise["condition_number"]
    shares = [value for name, value in promise.items() if name.endswith("_share")]
    assert len(shares) == 8
    assert max(shares) <= 1.0
    assert promise["smallest_distance_m"] >= made.limits["clearance_m"]


def test_limits_of_the_joints_alone_are_said_to_be_so(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    arm = changed(tmp_path, "limits", tool_speed_m_s=0.01)
    out = tmp_path / "motion.yaml"
    alone = ("--set", "constraints=joint_motion")
    start = ("--start", find_file("wam7-excitation.yaml"))
    assert call("--config", arm, "--out", out, *start, *alone, *QUICK) == 0
    assert "This motion may not run: speed of tool (wam/link7_dh) is " in capsys.readouterr().err
    assert call("--config", arm, "--out", out, *start, *QUICK) == 0
    assert "may not run" not in capsys.readouterr().err
    assert read_trajectory(out).promise["largest_speed_share"] <= 1.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--set", "speed=3"), "--set: 'speed=3' is not NAME=VALUE with a NAME of constraints, "),
        (("--set", "speed"), "--set: 'speed' is not NAME=VALUE with a NAME of constraints, "),
        (("--set", "time_s=-1"), "settings: time_s: "),
        (("--set", "weights={fx4: 2}"), "--weight: no parameter or kind 'fx4'; valid are "),
        (("--for", "gremlins"), "--for: no effect 'gremlins'; valid are asymmetric_viscous, "),
        (("--for", "stribeck:9"), "--for: no joint 9; the arm has 1 to 7."),
        (("--for", "stribeck:4", "--model", "m.yaml"), "--model: has no say in the fixed motions"),
        (("--model", "nowhere.yaml"), "nowhere.yaml"),
    ],
)
def test_wishes_that_nobody_can_fulfil(
    tmp_path: Path, capsys: pytest.CaptureFixture, arguments: tuple[str, ...], sentence: str
) -> None:
    out = tmp_path / "motion.yaml"
    assert call("--config", "wam7.yaml", "--out", out, *arguments) == 3
    assert sentence in capsys.readouterr().err
    assert not out.exists()


def test_a_start_for_another_tempo(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    arm = changed(tmp_path, "excitation", fundamental_rad_s=0.25, harmonics=4)
    start = find_file("wam7-excitation.yaml")
    assert call("--config", arm, "--start", start, "--out", tmp_path / "motion.yaml") == 3
    assert capsys.readouterr().err.strip() == (
        "ident: --start: 2 faults:\n"
        "  - it has 5 harmonics, not 4\n"
        "  - its fundamental is 0.314159 rad/s, not 0.25 rad/s"
    )


@pytest.mark.parametrize(
    ("section", "values", "sentence"),
    [
        (
            "limits",
            {"motor_torque_nm": [1.8, 0.01, 1.8, 1.6, 0.6, 0.6, 0.09]},
            "torque of motor 2 is ",
        ),
        ("limits", {"clearance_m": 0.4}, "distance of pedestal and upper arm is "),
        (
            "excitation",
            {"position_lower_rad": [-1.85, -1.0, -2.41, 2.9, -3.99, -1.3, -1.9]},
            "the position range of joint 4 is empty",
        ),
    ],
)
def test_limits_that_no_motion_keeps_are_named(
    tmp_path: Path,
    capsys: pytest.CaptureFixture,
    section: str,
    values: dict[str, object],
    sentence: str,
) -> None:
    arm = changed(tmp_path, section, **values)
    assert call("--config", arm, "--out", tmp_path / "motion.yaml", *QUICK) == 3
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "motion.yaml").exists()


def test_a_folder_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    out = tmp_path / "nowhere" / "motion.yaml"
    start = find_file("wam7-excitation.yaml")
    assert call("--config", "wam7.yaml", "--start", start, "--out", out, *QUICK) == 6
    assert (
        capsys.readouterr()
        .err.strip()
        .splitlines()[-1]
        .startswith(f"ident: {out} cannot be written")
    )
