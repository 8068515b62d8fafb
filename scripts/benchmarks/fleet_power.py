#!/usr/bin/env -S .venv/bin/python
"""Changes planted into the unchanged arms of a fleet: found how soon, named how well.

Usage: scripts/benchmarks/fleet_power.py FLEET OUT [--seed 0] [--arms 12] [--skip 0]
           [--kinds friction ...]

FLEET is a folder of `fleet_maker.py`, OUT that of `ident fleet` on it with --robot wam7.yaml. A
change d of the parameters adds X d to the torque, which is N d in a log's score: so are planted
10 % of friction, a Stribeck effect, half a kilogram, and a `slight` zero by 0.02 rad. `zero` is a
motor's turn, as the maker plants it, in which torque is not linear: its logs are made and reduced
anew, by the fleet's own --seed. Arms that the maker has changed are left out. The odds asked for
are those of one change among 200 arms. A change is beyond any test where seven days, with all else
known exactly, would not be expected to bring these odds (half of d^T N d): the zero of a joint
whose axis is upright, or hardly feels gravity.
"""

import argparse
import json
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow.parquet as pq
from fleet_maker import TURN, days, wam
from fleet_maker import arm as ordinary
from fleet_reduced import unchanged

from ident.fleet.arm_type import ArmType
from ident.fleet.changes import changes
from ident.fleet.fleet import even
from ident.fleet.hierarchy import learned
from ident.fleet.normal import Information, LogData
from ident.fleet.reduce import reduced
from ident.fleet.series import Series
from ident.fleet.settings import DEFAULT
from ident.fleet.triangles import unpacked
from ident.recordings.loading import Reading
from wamctl.arm.config import find_file

NAMES = {"friction": "parameter", "zero": "encoder_offset", "slight": "encoder_offset"}
KINDS = ("friction", "stribeck", "payload", "slight", "zero")
MOVES = 14
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


def made_anew(
    series: Series, arm: tuple[int, int], day: int, joint: int, sign: float
) -> list[Information]:
    """What the logs say up to a moved zero, and those from it on that are made for it.

    Args:
        series: the arm.
        arm: seed of its fleet and its number there.
        day: the first one.
        joint: from 1.
        sign: of the turn.
    """
    robot, own = wam(), np.random.default_rng(arm)
    truth = ordinary(robot.model.copy(), own)
    route = days(arm, own, len(series.entries), MOVES)
    zero = truth.zero + sign * TURN * (np.arange(len(TURN)) == joint - 1)
    found = [e.data(series.known.reference_c) for e in series.entries[:day]]
    place = find_file(Path("wam7.yaml")).resolve()
    with TemporaryDirectory() as folder:
        for d in range(day, day + DAYS + 1):
            path = Path(folder) / f"{d}.mcap"
            route.write(path, robot, replace(truth, zero=zero), d)
            r = reduced(path, place, Reading(), DEFAULT)
            warmer = series.entries[d].warmer_k(series.known.reference_c)
            joints, _ = unpacked(r.triangles or b"")
            found.append(LogData(joints, r.rows, r.rows_per_value, warmer))
            path.unlink()
    return series.said(found)


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
    """One change, by arithmetic in one arm's logs."""
    logs = series.information()
    d = size * step(series.kind, series.known.mean, what, joint)
    after = [Information(x.N, x.y + x.N @ d) for x in logs[day : day + 14]]
    most = sum(float(d @ x.N @ d) for x in logs[day : day + DAYS]) / 2
    return told(series, what, day, joint, [*logs[:day], *after], most)


def told(
    series: Series, what: str, day: int, joint: int, logs: Sequence[Information], most: float
) -> Case:
    """How a change is told.

    Args:
        series: the arm.
        what: of `KINDS`.
        day: the first log after it.
        joint: from 1.
        logs: of the arm, with the change.
        most: see `Case`.
    """
    known, once = series.known, replace(DEFAULT, changes=1)
    first = changes(logs, known.mean, known.D, series.candidates(), LEAST, once)
    if not first:
        return Case(joint, None, "nothing", False, most)
    found = first[0].candidate
    right = found.name == NAMES.get(what, what)
    right = right and (what == "payload" or found.joints == (joint,))
    return Case(joint, first[0].told - day, f"{found.name} {found.joints}", right, most)


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
    parser.add_argument("--skip", type=int, default=0, help="so many arms, seen before")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--seed", type=int, default=0, help="of the fleet")
    given = parser.parse_args()
    store, arms = unchanged(given.fleet, given.out)
    longest = max(len(e) for e in arms.values())
    arms = {a: e for a, e in arms.items() if len(e) == longest}
    quiet(given.out, arms)
    kind = store.arm_type(next(iter(arms.values()))[0].stored.reduced.type)
    teach = even(list(arms.values()), DEFAULT.type_arms)
    sample = [[e.data(24.0) for e in even(logs, DEFAULT.type_logs)] for logs in teach]
    known = learned(sample, kind, 24.0, DEFAULT.type_rounds)
    rng = np.random.default_rng(given.seed + 1)
    found: dict[str, list[Case]] = defaultdict(list)
    for arm, entries in list(arms.items())[given.skip :][: given.arms]:
        series = Series(arm, tuple(entries), kind, known, DEFAULT)
        for what in KINDS:
            day, joint = int(rng.integers(8, 28)), int(rng.integers(1, 7))
            sign = float(rng.choice([-1.0, 1.0])) if what in ("zero", "slight") else 1.0
            if what not in given.kinds:
                continue
            if what == "zero":
                own = given.seed, int(arm.removeprefix("arm"))
                logs = made_anew(series, own, day, joint, sign)
                found[what].append(told(series, what, day, joint, logs, np.inf))
            else:
                found[what].append(planted(series, what, day, joint, sign))
    for what, cases in found.items():
        summary(what, cases)
    summary("all", [c for cases in found.values() for c in cases])


if __name__ == "__main__":
    main()
