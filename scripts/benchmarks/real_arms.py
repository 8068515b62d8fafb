"""Real arms: whether what is named on some recordings carries over to others.

Run: .venv/bin/python scripts/benchmarks/real_arms.py --data FOLDER [--arm NAME].. [--work FOLDER]

The manifest `real_arms.yaml` tells the recordings; those that lie in FOLDER are run, by the
commands as a user types them: `ident run` and `ident gap` on some, `ident validate` of the models
on another. Prints a table: errors on the judged recording, filtered and raw, of the nominal model
(links, viscous and Coulomb friction), of the one with offsets and rotors on demand, and of the one
with effects; what was named, what is in the model without a name, what is only suspected, and
whether known numbers are met.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

MANIFEST = Path(__file__).with_suffix(".yaml")
_NOMINAL = ["--set", "terms=viscous,coulomb"]
_Z = 2.0  # standard deviations within which a known number is met


def ident(*words: object) -> int:
    """One command; its words go to stderr."""
    command = [sys.executable, "-c", "from ident.cli import main; main()", *map(str, words)]
    return subprocess.run(command, stdout=sys.stderr, check=False).returncode


class Case:
    """One arm of the manifest, with its recordings as logs."""

    def __init__(self, name: str, arm: dict[str, Any], data: Path, work: Path) -> None:
        self.name, self.arm = name, arm
        self._folder, self._work = data / arm["folder"], work / name
        self._work.mkdir(parents=True, exist_ok=True)

    def log(self, recording: str) -> Path:
        """A recording, imported where it is a table."""
        path = self._folder / self.arm["recordings"][recording]
        if "map" not in self.arm:
            return path
        log = self._work / f"{recording}.mcap"
        if not log.exists():
            ident("import", path, "--map", self._mapping(), "--out", log)
        return log

    def _mapping(self) -> Path | str:
        """The shipped mapping file, or the manifest's own, written out beside its arm."""
        mapping = self.arm["map"]
        if isinstance(mapping, str):
            return mapping
        arm = {"arm": self.name, **self.arm["robot"]}
        urdf = (self._folder / arm["robot"]["urdf"]).resolve()
        arm["robot"] = arm["robot"] | {"urdf": str(urdf)}
        robot, path = self._work / "arm.yaml", self._work / "map.yaml"
        robot.write_text(yaml.safe_dump(arm))
        path.write_text(yaml.safe_dump({"robot": robot.name, **mapping}))
        return path

    @property
    def robot(self) -> list[str]:
        """The option that tells the arm, where the log does not."""
        if "map" in self.arm:
            return []
        return ["--robot", str(self._folder / self.arm["robot"])]

    def searched(self, fitted: Sequence[str], judged: str | None) -> dict[str, Any]:
        """The models of some recordings, and their errors on another one."""
        logs = [self.log(r) for r in fitted]
        out = self._work / "+".join(fitted)
        row: dict[str, Any] = {"arm": self.name, "fitted": "+".join(fitted), "judged": judged}
        for name, more in ("nominal", _NOMINAL), ("run", []):
            ident("run", *logs, *self.robot, *more, "--out", out / name, "--force")
        start = time.perf_counter()
        row["exit"] = ident("gap", *logs, *self.robot, "--out", out / "gap", "--force")
        row["seconds"] = time.perf_counter() - start
        found = out / "gap" / "gap.json"
        if not found.exists():
            return row
        content = json.loads(found.read_text())
        row |= {"verdict": content["verdict"], "named": content["effects"]}
        row["suspected"] = content["suspected"]
        row["facts"] = facts_met(self.arm.get("facts", []), content["effects"])
        if judged is None:
            sides = (content["held_out"][k] for k in ("before", "after"))
            row["errors"] = [[side["relative_error_percent"], None] for side in sides]
        else:
            row["errors"] = [self._error(judged, out, m) for m in ("nominal", "run", "gap")]
        return row

    def _error(self, judged: str, out: Path, model: str) -> list[float | None]:
        """Relative error on a recording, and on its unfiltered torque [%].

        All models are judged at one cut-off, the nominal one's: more of the torque's noise counts
        at a higher one.
        """
        told = out / f"validate-{model}-{judged}"
        path = out / model / "model.yaml"
        words = ["validate", self.log(judged), "--model", path, "--out", told, "--force"]
        if (nominal := out / "nominal" / "run.json").exists():
            words += ["--cutoff", json.loads(nominal.read_text())["cutoff_hz"]]
        if ident(*words):
            return [None, None]
        (log,) = json.loads((told / "validate.json").read_text())["logs"]
        return [side["relative_error_percent"] for side in (log, log["raw_torque"])]


def facts_met(facts: Sequence[dict[str, Any]], named: Sequence[dict[str, Any]]) -> list[str]:
    """Known numbers beside the named ones."""
    told = []
    for fact in facts:
        for effect in named:
            if effect["name"] == fact["effect"] and effect["joints"] == fact["joints"]:
                value = effect["parameters"][fact["parameter"]]
                away = abs(value["value"] - fact["value"]) / value["sd"]
                told.append(
                    f"{value['value']:.4g} ± {value['sd']:.2g} of {fact['value']:g}"
                    f" ({'met' if away < _Z else 'not met'})"
                )
    return told


def place(effect: dict[str, Any]) -> str:
    """An effect with its joints, and how many standard deviations it is said to be from zero."""
    joints = ", ".join(map(str, effect["joints"]))
    away = effect["evidence"].get("standard_deviations")
    return f"{effect['name']} {joints}" + ("" if away is None else f" ({away:.1f} sd)")


def percent(error: float | None) -> str:
    """An error of the table; a dash where there is none, since the log was refused."""
    return "–" if error is None else f"{error:.2f}"


def line(row: dict[str, Any]) -> str:
    """A row of the table."""
    if "errors" not in row:
        return f"| {row['arm']} | {row['fitted']} | no result, exit code {row['exit']} |"
    errors, unfiltered = (
        " → ".join(map(percent, side)) for side in zip(*row["errors"], strict=True)
    )
    raw = "" if row["judged"] is None else f" ({unfiltered})"
    cells = [
        row["arm"],
        f"{row['fitted']} → {row['judged'] or 'held-out stretches'}",
        f"{errors}{raw}",
        row["verdict"],
        ", ".join(map(place, row["named"])) or "–",
        *(
            ", ".join(place(s) for s in row["suspected"] if s["in_model"] == held) or "–"
            for held in (True, False)
        ),
        ", ".join(row["facts"]) or "–",
        f"{row['seconds']:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--data", type=Path, required=True, help="folder of the recordings")
    options.add_argument("--arm", action="append", help="of the manifest; default: all there are")
    options.add_argument("--work", type=Path, help="folder for logs and results")
    chosen = options.parse_args()
    work = chosen.work or Path(tempfile.mkdtemp())
    arms = yaml.safe_load(MANIFEST.read_text())["arms"]
    columns = (
        *("arm", "fitted → judged", "error [%] (raw)", "verdict", "named"),
        *("in the model without a name", "suspected", "known", "s"),
    )
    print(f"| {' | '.join(columns)} |")
    print(f"|{' --- |' * len(columns)}")
    for name, arm in arms.items():
        there = (chosen.data / arm["folder"]).is_dir()
        if not there or name not in (chosen.arm or arms):
            continue
        case = Case(name, arm, chosen.data, work)
        pairs = [*arm.get("pairs", []), *([s, None] for s in arm.get("singles", []))]
        for fitted, judged in pairs:
            print(line(case.searched(fitted, judged)), flush=True)


if __name__ == "__main__":
    main()
