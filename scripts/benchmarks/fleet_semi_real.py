#!/usr/bin/env -S .venv/bin/python
"""The real xMate7 Pro as a fleet of one arm: is it quiet, and are changes by arithmetic told?

Usage: scripts/benchmarks/fleet_semi_real.py DATA OUT

DATA holds trajK_3per_50Hz.csv, three motions of three periods. Each period is a log, in the order
of the periods; the changes of `fleet_power.py` come with the sixth of the nine logs.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np
from fleet_power import LEAST, planted, summary
from fleet_reduced import entries_of

from ident.fleet.changes import evidence
from ident.fleet.hierarchy import learned
from ident.fleet.series import Series
from ident.fleet.settings import DEFAULT

PERIOD = 1000  # samples
ONSET = 5
TOLD = ("friction", "stribeck", "payload")  # a moved zero needs masses, which its URDF lacks
SIZES = (1.0, 3.0, 10.0)  # of those of the maker


def ident(*words: object) -> None:
    """An `ident` command."""
    subprocess.run([sys.executable, "-m", "ident.cli", *map(str, words)], check=True)


def cut(data: Path, folder: Path) -> None:
    """A log for each period of each motion."""
    folder.mkdir(parents=True, exist_ok=True)
    for motion in (1, 2, 3):
        head, *rows = (data / f"traj{motion}_3per_50Hz.csv").read_text("utf-8").splitlines()
        for period in range(3):
            table = folder / f"{period}{motion}.csv"
            part = rows[period * PERIOD : (period + 1) * PERIOD]
            table.write_text("\n".join([head, *part]), encoding="utf-8")
            log = table.with_suffix(".mcap")
            ident("import", table, "--map", "xmate7p-map.yaml", "--out", log)


def main() -> None:
    """Cuts, reduces, plants and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    logs = given.out / "logs" / "xmate"
    if not logs.exists():
        cut(given.data, logs)
    fleet = given.out / "fleet"
    ident("fleet", logs, "--robot", "xmate7p.yaml", "--out", fleet, "--workers", 1)
    store, arms = entries_of(logs, fleet, "xmate7p.yaml")
    (entries,) = arms.values()
    kind = store.arm_type(entries[0].stored.reduced.type)
    known = learned([[e.data(25.0) for e in entries]], kind, 25.0, DEFAULT.type_rounds)
    series = Series("xmate", tuple(entries), kind, known, DEFAULT)
    quiet = evidence(series.information(), series.detector())
    print(f"{len(entries)} logs as they are: highest log odds {np.max(quiet):.1f} of {LEAST:.1f}")
    for what, size in ((w, k) for w in TOLD for k in SIZES):
        joints = (7,) if what == "payload" else range(1, 8)
        cases = [planted(series, what, ONSET, j, size) for j in joints]
        summary(f"{what}, {size:g} times as large", cases)


if __name__ == "__main__":
    main()
