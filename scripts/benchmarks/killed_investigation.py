"""Investigations that are killed (SIGKILL) at random moments and resumed: the same end?

Run: .venv/bin/python scripts/benchmarks/killed_investigation.py FOLDER [--kills N] [--seed S]
     [--joints N] [--hidden NAME].. [--within SECONDS]

The arm is the shipped one up to one of its joints, in lockstep, its first motion one period long.
For each hidden effect it is investigated once without a kill, and once with N. These are dealt out
over its stages (each motion, each search, plan and weighing), each within so many seconds of the
stage's begin; every other kill is that of a program that the investigation runs, its descendants
included. What `investigation.json` says in the end is compared: verdict, effects with
their sizes, and each round's motion, evidence and odds.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import yaml

from wamctl.arm.config import shipped_file

STAGES = ("", "01/log.mcap", "01/gap", "02/plan", "02/slow.mcap", "02/log.mcap", "02/gap")
"""Files of an investigation whose being there begins a stage."""


def smaller(joints: int, folder: Path) -> Path:
    """The shipped arm up to a joint, with one period of its motion, as files of a folder."""

    def cut(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: cut(v) for k, v in value.items()}
        if isinstance(value, list):
            return [cut(v) for v in (value[:joints] if len(value) == 7 else value)]
        return value

    arm = cut(yaml.safe_load(shipped_file("wam7.yaml").read_bytes()))
    arm["limits"]["tool_frame"] = f"wam/link{joints}_dh"
    motion = cut(yaml.safe_load(shipped_file("wam7-excitation.yaml").read_bytes()))
    motion |= {"periods": 1, "promise": {}, "limits": {}}
    for name in ("wam7.urdf", "puck4.eds"):
        (folder / name).write_bytes(shipped_file(name).read_bytes())
    (folder / "wam7-excitation.yaml").write_text(yaml.safe_dump(motion), encoding="utf-8")
    (folder / "arm.yaml").write_text(yaml.safe_dump(arm, sort_keys=False), encoding="utf-8")
    return folder / "arm.yaml"


def begun(arm: Path, hidden: str, out: Path) -> subprocess.Popen[bytes]:
    """An investigation, begun or resumed."""
    words = ["wamctl", "investigate", "--config", str(arm), "--bus", "sim", "--lockstep"]
    words += ["--hidden", hidden] if hidden != "nothing" else []
    words += ["--limit", "motions=1", "--budget", "5h", "--out", str(out)]
    words += ["--resume"] if (out / "state.json").exists() else []
    with (out.parent / f"{out.name}.txt").open("ab") as said:
        return subprocess.Popen(words, stdout=said, stderr=said)


def descendants(process: int) -> list[int]:
    """Processes that a process has started, and those that they have."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        try:
            text = (entry / "stat").read_text() if entry.name.isdigit() else ""
        except OSError:
            continue
        if text:
            parents[int(entry.name)] = int(text.rpartition(")")[2].split()[1])
    found = [process]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found[1:]


def within_stage(process: subprocess.Popen[bytes], begin: Path, seconds: float) -> bool:
    """Wait until a stage has begun, and some seconds more; False: the process has ended before."""
    while process.poll() is None and not begin.exists():
        time.sleep(0.05)
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return True
    return False


def killed(arm: Path, hidden: str, out: Path, times: int, within_s: float, seed: int) -> int:
    """Kill an investigation again and again, then let it end; gives how many kills hit it."""
    rng, hit = random.Random(f"{seed} {hidden}"), 0
    for number in range(times):
        stage = STAGES[number * len(STAGES) // times]
        process = begun(arm, hidden, out)
        if within_stage(process, out / "rounds" / stage, rng.uniform(0.0, within_s)):
            others = descendants(process.pid)
            victim = rng.choice(others) if number % 2 and others else process.pid
            try:
                os.kill(victim, signal.SIGKILL)
                hit += 1
            except ProcessLookupError:
                print("a program had ended before it could be killed")
            if victim != process.pid:
                try:
                    process.wait(60.0)
                except subprocess.TimeoutExpired:
                    process.kill()
            process.wait()
            time.sleep(1.0)
            left = [p for p in others if Path(f"/proc/{p}/cmdline").exists()]
            left = [p for p in left if b"investig" in Path(f"/proc/{p}/cmdline").read_bytes()]
            what = "itself" if victim == process.pid else "a program of it"
            print(
                f"{hidden}: after {stage or 'the begin'}: killed {what}, exit code"
                f" {process.returncode}, left {left}",
                flush=True,
            )
    for _ in range(3):
        if begun(arm, hidden, out).wait() == 0:
            break
    return hit


def ends(out: Path) -> dict[str, Any]:
    """What an investigation has found, without times and names of folders."""
    found = json.loads((out / "investigation.json").read_text("utf-8"))
    kept = ("verdict", "confirmed", "effects", "why")
    rounds = [
        {k: r[k] for k in ("reason", "verdict", "answer", "evidence_nats", "odds", "motion_s")}
        for r in found["rounds"]
    ]
    return {k: found[k] for k in kept} | {"rounds": rounds}


def main() -> None:
    """Print how each ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--kills", type=int, default=15)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--joints", type=int, default=4)
    parser.add_argument("--hidden", action="append")
    parser.add_argument("--within", type=float, default=15.0)
    wanted = parser.parse_args()
    wanted.folder.mkdir(parents=True, exist_ok=True)
    arm = smaller(wanted.joints, wanted.folder)
    same = True
    for hidden in wanted.hidden or ["stribeck", "nothing"]:
        whole, cut = (wanted.folder / f"{hidden}-{kind}" for kind in ("whole", "killed"))
        if not (whole / "investigation.json").exists():
            began = time.monotonic()
            begun(arm, hidden, whole).wait()
            print(f"{hidden}: {time.monotonic() - began:.0f} s without a kill", flush=True)
        hit = killed(arm, hidden, cut, wanted.kills, wanted.within, wanted.seed)
        first, second = ends(whole), ends(cut)
        same = same and first == second
        word = "the same" if first == second else "ANOTHER"
        print(
            f"{hidden}: {hit} kills, {word} end: {second['verdict']}, {second['why']}", flush=True
        )
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
