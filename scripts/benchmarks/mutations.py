"""Random mutations of an arm's file and of its URDF: refused, stopped, or within the arm's limits?

Usage: scripts/benchmarks/mutations.py [YAML [URDF]] [--first N], from the root, in .venv.

Each mutation changes one value, key, line or character of the shipped WAM's file (2000 times) or
URDF (500 times), whose motion is one of a second. What passes every check drives an ideal arm that
is the unmutated one: test of the motors, approach, excitation, return. A mutation is harmful if the
arm passes 1.25 times a speed limit of the unmutated file (joints, with `velocity_margin`; tool) or
1.25 times its position margin, or if anything but a sentence comes of it. Exits with 1 if any is.
"""

import argparse
import random
import re
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from ideal_arm import PERIOD_S, REST, IdealDrives, ListLog

from wamctl.arm.config import find_file
from wamctl.arm.errors import UserError
from wamctl.arm.trajectory import FourierSeries, Trajectory, write_trajectory
from wamctl.errors import StopError
from wamctl.experiment import phases as experiment
from wamctl.experiment.loop import Arm, Loop
from wamctl.experiment.preflight import load_arm, prepare
from wamctl.realtime.clock import LockstepClock

ROOM = 1.25
FACTORS = (-1.0, 0.0, 0.1, 0.5, 0.9, 1.1, 1.5, 2.0, 10.0, 1e3, 1e9, 1e300)
VALUES = (float("nan"), float("inf"), None, "", "1,5", "on", [], {}, [1.0], -1, 10**30, "\x1b[31m")
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


def mutated_yaml(rng: random.Random, text: str) -> str:
    """One value, key or character of the file changed."""
    if rng.random() < 0.2:
        return mutated_text(rng, text)
    content = yaml.safe_load(text)
    place, key = rng.choice(list(leaves(content)))
    value = place[key]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    kind = rng.random()
    if is_number and kind < 0.7:
        place[key] = value * rng.choice(FACTORS)
    elif isinstance(place, dict) and kind < 0.85:
        del place[key]
        if rng.random() < 0.5:
            place[f"{key}x"] = value
    else:
        place[key] = rng.choice(VALUES)
    return yaml.safe_dump(content)


def leaves(content: Any):
    """Every place of a value: its container and key."""
    items = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in items:
        yield content, key
        if isinstance(value, dict | list):
            yield from leaves(value)


def mutated_urdf(rng: random.Random, text: str) -> str:
    """One number or character of the URDF changed."""
    if rng.random() < 0.3:
        return mutated_text(rng, text)
    found = rng.choice(list(NUMBER.finditer(text)))
    value = float(found.group())
    new = rng.choice([repr(value * rng.choice(FACTORS)), "nan", "1,5", "", "1e400", "-0"])
    return text[: found.start()] + new + text[found.end() :]


def mutated_text(rng: random.Random, text: str) -> str:
    """A line lost, doubled or swapped, or a character changed."""
    rows, kind = text.splitlines(keepends=True), rng.randrange(4)
    k = rng.randrange(len(rows) - 1)
    if kind == 0:
        del rows[k]
    elif kind == 1:
        rows.insert(k, rows[k])
    elif kind == 2:
        rows[k], rows[k + 1] = rows[k + 1], rows[k]
    else:
        spot = rng.randrange(len(text))
        return text[:spot] + chr(rng.randrange(1, 0x250)) + text[spot + 1 :]
    return "".join(rows)


class Watched(IdealDrives):
    """The unmutated arm, which remembers how far its limits were used."""

    def __init__(self, arm: Arm) -> None:
        super().__init__(arm)
        limits, safety = arm.file.limits, arm.file.safety
        self.worst, self._limits = 0.0, limits
        self._speeds = safety.velocity_margin * np.array(limits.velocity_rad_s)
        self._low = np.array(limits.position_lower_rad) - ROOM * safety.position_margin_rad
        self._high = np.array(limits.position_upper_rad) + ROOM * safety.position_margin_rad
        self._tool = self._model.getFrameId(limits.tool_frame)

    def sample(self, timing: Any) -> Any:
        """One period of the arm, and how much of its limits it used."""
        readings = super().sample(timing)
        pin.forwardKinematics(self._model, self._data, self._q, self._qd)
        world = pin.LOCAL_WORLD_ALIGNED
        tool = pin.getFrameVelocity(self._model, self._data, self._tool, world).linear
        used = [np.abs(self._qd / self._speeds).max(), np.linalg.norm(tool)]
        used[1] /= self._limits.tool_speed_m_s
        inside = np.all((self._q > self._low) & (self._q < self._high))
        self.worst = max(self.worst, *used, 0.0 if inside else np.inf)
        return readings


def outcome(config: Path, truth: Arm) -> str:
    """How a mutated file ends."""
    try:
        prepared = prepare(config)
    except UserError as error:
        return "refused" if "\x1b" not in str(error) else "harmful: escape in the sentence"
    arm, drives = prepared.arm, Watched(truth)
    if arm.file == truth.file and arm.robot.urdf == truth.robot.urdf:
        return "changed nothing"
    try:
        loop = Loop(arm, drives, LockstepClock(PERIOD_S), ListLog(), lambda: None)
        motion = experiment.plan(arm, REST, prepared.excitation)
        experiment.run(arm, drives, loop, motion)
        end = "ran"
    except StopError as stop:
        end = f"stopped in {stop.phase}"
    except UserError:
        return "refused at the start pose"
    return end if drives.worst <= ROOM else f"harmful: {drives.worst:.2f} of a limit, {end}"


def unmutated(folder: Path) -> tuple[str, str]:
    """The shipped arm's file with a short motion, and its URDF, as texts."""
    config, urdf = (find_file(f"wam7.{x}").read_text("utf-8") for x in ("yaml", "urdf"))
    joints = load_arm("wam7.yaml")[1].robot.joint_names
    sine = FourierSeries(joints, 2 * np.pi, np.full((7, 1), 0.3), np.zeros((7, 1)), REST + 0.05)
    write_trajectory(folder / "short.yaml", Trajectory(sine, 1, {}, {}))
    for old, new in (
        ("puck4.eds", str(find_file("puck4.eds"))),
        ("wam7-excitation.yaml", str(folder / "short.yaml")),
        ("ramp_s: 3.0", "ramp_s: 0.5"),
    ):
        config = config.replace(old, new)
    return config, urdf


def written(folder: Path, config: str, urdf: str) -> Path:
    """The arm's file beside its URDF."""
    (folder / "wam7.urdf").write_text(urdf, encoding="utf-8")
    (folder / "arm.yaml").write_text(config, encoding="utf-8")
    return folder / "arm.yaml"


def main() -> int:
    """Runs all mutations, and tells how they ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("counts", type=int, nargs="*", default=[2000, 500])
    parser.add_argument("--first", type=int, default=0)
    given, harmful = parser.parse_args(), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config, urdf = unmutated(folder)
        truth = load_arm(written(folder, config, urdf))[1]
        for kind, count in zip(("YAML", "URDF"), given.counts, strict=False):
            ends: Counter[str] = Counter()
            began_s = time.process_time()
            for seed in range(given.first, given.first + count):
                rng = random.Random(f"{kind} {seed}")
                wrong_config = mutated_yaml(rng, config) if kind == "YAML" else config
                wrong_urdf = mutated_urdf(rng, urdf) if kind == "URDF" else urdf
                try:
                    end = outcome(written(folder, wrong_config, wrong_urdf), truth)
                except Exception as error:  # noqa: BLE001 - a user would see a bug
                    end = f"harmful: {type(error).__name__}: {error}"
                ends[end.partition(":")[0]] += 1
                if end.startswith("harmful"):
                    harmful += 1
                    print(f"{kind} {seed}: {end}", flush=True)
                if ends.total() % 50 == 0:
                    print(f"{kind}: {ends.total()} done", file=sys.stderr, flush=True)
            took_s = (time.process_time() - began_s) / max(1, count)
            print(f"{kind}: {count}, {took_s:.2f} s of a core a case: {dict(ends)}", flush=True)
    return int(harmful > 0)


if __name__ == "__main__":
    sys.exit(main())
