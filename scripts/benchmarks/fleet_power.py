#!/usr/bin/env -S .venv/bin/python
"""Changes planted by arithmetic into the reduced logs of a fleet: found how soon, named how well.

Usage: scripts/benchmarks/fleet_power.py FLEET OUT [--arms 12]

FLEET is a folder of `fleet_maker.py`, OUT that of `ident fleet` on it with --robot wam7.yaml. A
change d of the parameters adds X d to the torque, which is N d in a log's score. Arms that the
maker has changed are left out. The odds asked for are those of one change among 200 arms. A change
is beyond any test where seven days, with all else known exactly, would not be expected to bring
these odds (half of d^T N d): the zero of a joint whose axis is upright, or hardly feels gravity.
"""

import argparse
import json
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from fleet_reduced import unchanged

from ident.fleet.arm_type import ArmType
from ident.fleet.changes import changes
from ident.fleet.fleet import even
from ident.fleet.hierarchy import learned
from ident.fleet.normal import Information
from ident.fleet.series import Series
from ident.fleet.settings import DEFAULT

NAMES = {"friction": "parameter", "zero": "encoder_offset"}
KINDS = ("friction", "stribeck", "payload", "zero")
LEAST = np.log(200 / DEFAULT.false_alarm_share)
DAYS = 7
LOAD = [0.5, 0.01, -0.005, 0.03, 0.0025, 0, 0, 0.0025, 0, 0.0004]


def step(kind: ArmType, mean: np.ndarray, what: str, joint: int) -> np.ndarray:
    """The change of the parameters."""
    d = np.zeros(len(mean))
    if what == "payload":
        return kind.payload @ np.array(LOAD)
    if what == "friction":
        for place in kind.places[("fc", joint)] + kind.places[("fv", joint)]:
            d[place] = 0.1 * mean[place]
    elif what == "stribeck":
        d[kind.places[("stribeck", joint)][1]] = 0.3 * mean[kind.places[("fc", joint)][0]]
    else:
        d[kind.places[("zero", joint)][0]] = 0.02
    return d


@dataclass(frozen=True)
class Case:
    """A change that was planted.

    Attributes:
        joint: from 1.
        days: from the change to the log after which it was told; None: never.
        name: what it was called.
        right: whether that is its kind and joint.
        most: log odds that seven days would bring if all else were known.
    """

    joint: int
    days: int | None
    name: str
    right: bool
    most: float


def quiet(out: Path, arms: Collection[str]) -> None:
    """Prints how near to a false alarm unchanged arms came."""
    highest, days = dict.fromkeys(arms, -np.inf), 0
    for row in pq.read_table(out / "logs.parquet", columns=["arm", "log_odds"]).to_pylist():
        if row["arm"] in highest and row["log_odds"] is not None:
            highest[row["arm"]] = max(highest[row["arm"]], row["log_odds"])
            days += 1
    told = {c["arm"] for c in json.loads((out / "changes.json").read_text("utf-8"))}
    nearest = np.sort(list(highest.values()))[-3:].round(1).tolist()
    print(
        f"{len(told & set(arms))} false alarms of {len(highest)} unchanged arms in {days} arm-days;"
        f" highest log odds {nearest}, asked for {LEAST:.1f}"
    )


def planted(series: Series, what: str, day: int, joint: int, size: float) -> Case:
    """One change, by arithmetic in one arm's logs.

    Args:
        series: the arm.
        what: of `KINDS`.
        day: the first log after it.
        joint: from 1.
        size: of the change, in those of the maker.
    """
    known, once = series.known, replace(DEFAULT, changes=1)
    logs, looked = series.information(), series.candidates()
    d = size * step(series.kind, known.mean, what, joint)
    after = [Information(x.N, x.y + x.N @ d) for x in logs[day : day + 14]]
    most = sum(float(d @ x.N @ d) for x in logs[day : day + DAYS]) / 2
    told = changes([*logs[:day], *after], known.mean, known.D, looked, LEAST, once)
    if not told:
        return Case(joint, None, "nothing", False, most)
    found = told[0].candidate
    right = found.name == NAMES.get(what, what)
    right = right and (what == "payload" or found.joints == (joint,))
    return Case(joint, told[0].told - day, f"{found.name} {found.joints}", right, most)


def summary(what: str, cases: Sequence[Case]) -> None:
    """Prints how changes were told."""
    soon = [c for c in cases if c.days is not None and c.days < DAYS]
    named, shown = sum(c.right for c in soon), [c for c in cases if c.most >= LEAST]
    print(
        f"{what}: {len(soon)} of {len(cases)} within {DAYS} days, {named} of these named;"
        f" {sum(c in soon for c in shown)} of the {len(shown)} that {DAYS} days can show",
        flush=True,
    )
    late = sorted((c.joint, c.days or 0, round(c.most, 1)) for c in cases if c not in soon)
    wrong = sorted((c.joint, c.name) for c in soon if not c.right)
    print(f"  late, or never = 0 (joint, days, most): {late}; wrong: {wrong}")


def main() -> None:
    """Plants, tests and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fleet", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--arms", type=int, default=12)
    given = parser.parse_args()
    store, arms = unchanged(given.fleet, given.out)
    quiet(given.out, arms)
    kind = store.arm_type(next(iter(arms.values()))[0].stored.reduced.type)
    teach = even(list(arms.values()), DEFAULT.type_arms)
    sample = [[e.data(24.0) for e in even(logs, DEFAULT.type_logs)] for logs in teach]
    known = learned(sample, kind, 24.0, DEFAULT.type_rounds)
    rng = np.random.default_rng(0)
    found: dict[str, list[Case]] = defaultdict(list)
    for arm, entries in list(arms.items())[: given.arms]:
        series = Series(arm, tuple(entries), kind, known, DEFAULT)
        for what in KINDS:
            day, joint = int(rng.integers(8, 28)), int(rng.integers(1, 7))
            sign = rng.choice([-1.0, 1.0]) if what == "zero" else 1.0
            found[what].append(planted(series, what, day, joint, sign))
    for what, cases in found.items():
        summary(what, cases)
    summary("all", [c for cases in found.values() for c in cases])


if __name__ == "__main__":
    main()
