"""The last sentences of the demo: what was hidden, what was found, and what without it."""

import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "tell-gap"
SPRING = {
    "name": "joint_spring",
    "joints": [3],
    "parameters": {
        "stiffness": {"value": 1.2004, "sd": 0.0312, "unit": "N m/rad"},
        "share": {"value": 0.25, "sd": 0.01, "unit": "1"},
        "torque_at_zero": {"value": 0.0, "sd": 0.0, "unit": "N m"},
    },
}


def gap(verdict, *effects):
    errors = {"before": {"relative_error_percent": 8.54}, "after": {"relative_error_percent": 0.05}}
    return {"verdict": verdict, "effects": effects, "held_out": errors | {"closed_fraction": 0.99}}


def told(folder, hidden, found, without):
    names = []
    for name, content in (("found", found), ("without", without)):
        (folder / name).write_text(json.dumps(content))
        names.append(str(folder / name))
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    said = subprocess.run(
        [sys.executable, SCRIPT, hidden, *names],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PATH": path},
    )
    return said.stdout.splitlines()


def test_name_joint_size_and_share_closed_are_told(tmp_path):
    assert told(tmp_path, "joint_spring", gap("named", SPRING), gap("no_gap")) == [
        "Hidden:     joint 3 (shoulder yaw): a cable harness that pulls with 1.2 N m/rad towards "
        "0.3 rad.",
        "Found:      joint_spring at joint 3 (stiffness 1.2 ± 0.03 N m/rad, share 0.25 ± 0.01). It "
        "closes 99 % of the gap: the held-out error falls from 8.54 to 0.05 %.",
        "Without it: nothing is missing.",
    ]


def test_a_doubtful_verdict_is_said_first(tmp_path):
    lines = told(tmp_path, "mine.yaml", gap("unknown"), gap("ambiguous", SPRING))
    assert lines[0] == "Hidden:     mine.yaml."
    assert lines[1].startswith("Found:      unknown: no effect by name. It closes 99 % of the gap")
    assert lines[2].startswith("Without it: ambiguous: joint_spring at joint 3 (stiffness 1.2")
