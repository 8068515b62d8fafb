"""Investigations of simulated arms that hide an effect, one outside the catalogue, or nothing.

Run: .venv/bin/python scripts/benchmarks/investigations.py FOLDER [--known N] [--outside N]
     [--nothing N] [--kills N] [--seed S] [--budget DURATION]
     .venv/bin/python scripts/benchmarks/investigations.py FOLDER --table

Each case is drawn from its seed: family, joint and size, between a quarter and twice the usual one.
`wamctl investigate` runs in lockstep; FOLDER/cases.jsonl gets a line for each, which `--table` sums
up: right, wrong and confirmed, motion until the end, and the Brier score of the odds. With
`--kills`, so many cases are killed (SIGKILL) once at a random moment, resumed, and compared with
the same case that was not.
"""

import argparse
import json
import random
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

KNOWN: dict[str, dict[str, float]] = {
    "torque_offset": {"nm": 0.5},
    "stribeck": {"extra_nm": 0.5},
    "nonlinear_viscous": {"quadratic_nm_s2_rad2": 0.5},
    "joint_spring": {"nm_rad": 0.8},
    "load_dependent_friction": {"share": 0.06},
    "torque_gain": {"factor": 0.06},
    "encoder_offset": {"rad": 0.02},
    "rotor_inertia": {"kg_m2": 0.05},
}
"""Families with their usual size, at joints 2 to 4."""
OUTSIDE: dict[str, dict[str, float]] = {
    "hose": {"nm": 2.0},
    "angle_dependent_friction": {"nm": 0.5},
    "angle_dependent_drag": {"nm_s_rad": 0.5},
}
JOINTS = (2, 3, 4)


@dataclass(frozen=True)
class Case:
    """One arm.

    Attributes:
        kind: known, outside or nothing.
        seed: of the draw, and of the simulated arm.
        family: of the hidden effect; empty for nothing.
        joint: from 1; 0 for nothing.
        size: in the family's unit.
    """

    kind: str
    seed: int
    family: str = ""
    joint: int = 0
    size: float = 0.0

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.kind}-{self.seed}"

    @property
    def answer(self) -> str:
        """What ought to be said."""
        return {"known": "named", "outside": "unknown", "nothing": "no_gap"}[self.kind]


def drawn(kind: str, seed: int) -> Case:
    """The case of a seed."""
    if kind == "nothing":
        return Case(kind, seed)
    rng = np.random.default_rng([seed, len(kind)])
    families = KNOWN if kind == "known" else OUTSIDE
    family = str(rng.choice(sorted(families)))
    (usual,) = families[family].values()
    size = usual * float(np.exp(rng.uniform(np.log(0.25), np.log(2.0))))
    return Case(kind, seed, family, int(rng.choice(JOINTS)), size)


def hidden_file(case: Case, folder: Path) -> Path:
    """The file that hides it."""
    (field,) = (KNOWN | OUTSIDE)[case.family]
    value = 1.0 - case.size if case.family == "torque_gain" else case.size
    effect = {"effect": case.family, "joints": [case.joint], field: value}
    path = folder / f"{case.name}.yaml"
    path.write_text(yaml.safe_dump({"effects": [effect]}), encoding="utf-8")
    return path


def command(case: Case, folder: Path, out: Path, budget: str) -> list[str]:
    """The investigation of a case."""
    words = ["wamctl", "investigate", "--config", "wam7.yaml", "--bus", "sim", "--lockstep"]
    words += ["--seed", str(case.seed), "--budget", budget, "--out", str(out)]
    return words + (["--hidden", str(hidden_file(case, folder))] if case.family else [])


def investigated(case: Case, folder: Path, budget: str) -> dict[str, Any]:
    """Run a case to its end."""
    out = folder / case.name
    began = time.monotonic()
    resume = ["--resume"] if (out / "state.json").exists() else []
    done = subprocess.run([*command(case, folder, out, budget), *resume], check=False)
    line = asdict(case) | {"exit": done.returncode, "seconds": time.monotonic() - began}
    path = out / "investigation.json"
    return line | (told(case, json.loads(path.read_text("utf-8"))) if path.exists() else {})


def told(case: Case, found: dict[str, Any]) -> dict[str, Any]:
    """What an investigation said, and whether it is right."""
    names = [(e["name"], e["joints"]) for e in found["effects"]]
    right = found["verdict"] == case.answer
    if case.kind == "known":
        right = right and any(n == case.family and case.joint in j for n, j in names)
        right = right and len(names) == 1
    truth = f"{case.family}:{case.joint}" if case.kind == "known" else "none"
    truth = "unknown" if case.kind == "outside" else truth
    odds = found["rounds"][-1]["odds"]
    brier = sum((p - (name == truth)) ** 2 for name, p in odds.items())
    return {
        "verdict": found["verdict"],
        "confirmed": found["confirmed"],
        "effects": names,
        "right": right,
        "motions": len(found["rounds"]),
        "motion_s": found["motion_s"],
        "odds_of_truth": odds.get(truth, 0.0),
        "brier": brier + (0.0 if truth in odds else 1.0),
        "closed": found["held_out"]["closed_fraction"],
    }


def killed(case: Case, folder: Path, budget: str, whole_s: float) -> bool:
    """Kill a case at a random moment, resume it; whether it ends as the one that was not killed."""
    out = folder / f"{case.name}-killed"
    words = command(case, folder, out, budget)
    process = subprocess.Popen(words)
    after_s = random.Random(case.seed).uniform(0.0, whole_s)
    try:
        process.wait(after_s)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
    time.sleep(5.0)
    resume = ["--resume"] if (out / "state.json").exists() else []
    subprocess.run([*words, *resume], check=False)
    first, second = (
        json.loads((p / "investigation.json").read_text("utf-8")) for p in (folder / case.name, out)
    )
    same = all(first[key] == second[key] for key in ("verdict", "confirmed", "effects"))
    print(f"{case.name}: killed after {after_s:.0f} s, {'the same' if same else 'ANOTHER'} end")
    return same


def table(folder: Path) -> None:
    """Sum up what has been run."""
    text = (folder / "cases.jsonl").read_text("utf-8")
    lines = [json.loads(line) for line in text.splitlines()]
    for kind in ("known", "outside", "nothing"):
        own = [x for x in lines if x["kind"] == kind and "verdict" in x]
        if not own:
            continue
        wrong = sum(x["verdict"] == "named" and x["confirmed"] and not x["right"] for x in own)
        print(
            f"{kind}: {sum(x['right'] for x in own)} of {len(own)} right, {wrong} wrong and "
            f"confirmed; motion {np.median([x['motion_s'] for x in own]):.0f} s, on the clock "
            f"{np.median([x['seconds'] for x in own]):.0f} s (medians); Brier score "
            f"{np.mean([x['brier'] for x in own]):.3f}"
        )
    for x in lines:
        told_ = f"{x.get('verdict')} {x.get('effects')} confirmed {x.get('confirmed')}"
        print(f"  {x['family'] or 'nothing'}:{x['joint']} {x['size']:.3g}: {told_}")


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    for kind in ("known", "outside", "nothing", "kills"):
        parser.add_argument(f"--{kind}", type=int, default=0)
    parser.add_argument("--seed", type=int, default=70000)
    parser.add_argument("--budget", default="60min")
    parser.add_argument("--table", action="store_true")
    wanted = parser.parse_args()
    if wanted.table:
        table(wanted.folder)
        return
    wanted.folder.mkdir(parents=True, exist_ok=True)
    kinds = ("known", "outside", "nothing")
    cases = [drawn(k, wanted.seed + i) for k in kinds for i in range(getattr(wanted, k))]
    left = wanted.kills
    for case in cases:
        line = investigated(case, wanted.folder, wanted.budget)
        if left > 0 and line["exit"] == 0:
            left -= 1
            line["same_after_kill"] = killed(case, wanted.folder, wanted.budget, line["seconds"])
        with (wanted.folder / "cases.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    sys.exit(main())
