"""An investigation over a bus of this kernel: the simulated arm in its own process, in lockstep.

Run: scripts/vcan-test .venv/bin/python scripts/benchmarks/served_investigation.py FOLDER
     [--bus BUS] [--joints N] [--hidden NAME] [--motions N]

The arm is the shipped one up to one of its joints, its first motion one period long, as in
`killed_investigation.py`. In the guest kernel of `scripts/vcan-test` FOLDER has to lie in memory:
`/dev/shm/investigation`. Prints how it ended.
"""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

import yaml
from killed_investigation import smaller
from served_arm import program, served


def investigated(arm: Path, bus: str, motions: int, out: Path) -> int:
    """The exit code of an investigation over a bus."""
    name = yaml.safe_load(arm.read_text(encoding="utf-8"))["arm"]
    words = [program("wamctl"), "investigate", "--config", str(arm), "--bus", bus, "--lockstep"]
    words += ["--limit", f"motions={motions}", "--budget", "5h", "--out", str(out)]
    return subprocess.run([*words, "--yes-move-the-arm", name], check=False).returncode


def main() -> None:
    """Print how it ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--bus", default="socketcan:vcan0")
    parser.add_argument("--joints", type=int, default=4)
    parser.add_argument("--hidden", default="stribeck")
    parser.add_argument("--motions", type=int, default=1)
    wanted = parser.parse_args()
    wanted.folder.mkdir(parents=True, exist_ok=True)
    arm, out = smaller(wanted.joints, wanted.folder), wanted.folder / "investigation"
    began = time.monotonic()
    with served(arm, wanted.bus, "--lockstep", "--hidden", wanted.hidden):
        code = investigated(arm, wanted.bus, wanted.motions, out)
    print(f"exit code {code} after {time.monotonic() - began:.0f} s over {wanted.bus}")
    if not (out / "investigation.json").exists():
        sys.exit(1)
    found = json.loads((out / "investigation.json").read_text("utf-8"))
    sure = "confirmed" if found["confirmed"] else "not confirmed"
    print(f"{found['verdict']} ({sure}), {found['motion_s']:.0f} s of motion: {found['why']}")
    for effect in found["effects"]:
        print(f"  {effect['name']} at {effect['joints']}: {effect['parameters']}")
    sys.exit(code)


if __name__ == "__main__":
    main()
