"""What a reader of the documentation brings: a small arm and short recordings, named as there.

The files `wam7.yaml`, `so101-map.yaml` and `stribeck` hide the shipped ones of these names from the
commands of their folder, so that an experiment of two joints and some seconds stands in for the
WAM's.
"""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.pendulum import pendulum
from tests.unit.fleet.conftest import JOINTS, ordinary, write_log
from tests.unit.output_error import servo_arm
from wamctl.arm.config import shipped_file
from wamctl.arm.trajectory import FourierSeries, Trajectory, write_trajectory

OMEGA_RAD_S = 2 * np.pi / 5.0


def bring(folder: Path) -> None:
    """Writes all of it."""
    (folder / "my_arm.urdf").write_text(pendulum(), encoding="utf-8")
    robot = {"urdf": "my_arm.urdf", "joints": list(JOINTS)}
    write(folder / "my_arm.yaml", {"arm": "mine", "robot": robot})
    write(folder / "wam7.yaml", small_arm(robot))
    a, b = np.random.default_rng(0).uniform(-0.45, 0.45, (2, 2, 3))
    series = FourierSeries(JOINTS, OMEGA_RAD_S, a, b, np.zeros(2))
    write_trajectory(folder / "motion.yaml", Trajectory(series, 1, {}, {}))
    hidden = {"effect": "stribeck", "joints": [2], "form": "gaussian"}
    hidden |= {"extra_nm": 0.5, "speed_rad_s": 0.25}
    write(folder / "stribeck", {"effects": [hidden]})
    bring_bags(folder)
    bring_servo_logs(folder)


def write(path: Path, content: dict[str, Any]) -> None:
    path.write_text(yaml.safe_dump(content), encoding="utf-8")


def small_arm(robot: dict[str, Any]) -> dict[str, Any]:
    """The WAM's file with the first two of its joints, and a loop that moves the pendulum."""
    content = first_two(yaml.safe_load(shipped_file("wam7.yaml").read_text("utf-8")))
    content["robot"] = robot
    content["transmission"]["motor_from_joint"] = [[42.0, 0.0], [0.0, 28.0]]
    content["drives"]["dictionary"] = str(shipped_file("puck4.eds"))
    content["limits"] |= {"elbow_frame": "upper", "tool_frame": "lower"}
    content["controller"]["bandwidth_rad_s"] = [30.0, 30.0]
    content["excitation"] |= {"trajectory": "motion.yaml", "ramp_s": 1.0}
    content["simulation"]["start_pose_rad"] = [0.0, 0.0]
    return content


def first_two(value: Any) -> Any:
    """The same with every list of seven cut."""
    if isinstance(value, dict):
        return {key: first_two(one) for key, one in value.items()}
    return value[:2] if isinstance(value, list) and len(value) == 7 else value


def bring_bags(folder: Path) -> None:
    """Bags of the arm, and those of a fleet of two."""
    rng = np.random.default_rng(1)
    arm = ordinary(rng)
    for name in ("bag", "other"):
        write_log(folder / f"{name}.mcap", arm, 0, rng)
    (folder / "site").mkdir()
    for number in range(2):
        arm = replace(ordinary(rng), load=0.1 * number)
        for day in range(2):
            path = folder / f"logs/arm{number}/day{day}.mcap"
            write_log(path, arm, day, rng, seconds=10.0)
            site = folder / f"site/arm{number}_2026-01-0{day + 1}_24.mcap"
            site.symlink_to(path)
    rows = [["log", "arm"], ["arm0/day0.mcap", "left"], ["arm1/day0.mcap", "right"]]
    with (folder / "logs.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)


def bring_servo_logs(folder: Path) -> None:
    """Logs of two position servos, and a table with its mapping."""
    for seed, name in enumerate(("chirp", "steps", "slow")):
        servo_arm.log(folder / f"{name}.mcap", seconds=8.0, seed=seed)
    (folder / "servos.urdf").write_text(servo_arm.URDF, encoding="utf-8")
    robot = {"urdf": "servos.urdf", "joints": list(servo_arm.JOINTS)}
    write(folder / "so101.yaml", {"arm": "servos", "robot": robot})
    columns = {kind: [f"{kind}_{joint}" for joint in servo_arm.JOINTS] for kind in ("pos", "cmd")}
    mapping = {"robot": "so101.yaml", "time": {"column": "t_s"}}
    mapping |= {"position": {"columns": columns["pos"]}}
    mapping |= {"command_position": {"columns": columns["cmd"]}}
    write(folder / "so101-map.yaml", mapping)
    recorded = servo_arm.recording(seconds=8.0, seed=3)
    assert recorded.command is not None
    table = np.column_stack([recorded.stamp_ns / 1e9, recorded.q, recorded.command.q])
    header = ",".join(["t_s", *columns["pos"], *columns["cmd"]])
    np.savetxt(folder / "multisine.csv", table, delimiter=",", header=header, comments="")
