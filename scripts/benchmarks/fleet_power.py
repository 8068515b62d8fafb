#!/usr/bin/env -S .venv/bin/python
"""Changes planted by arithmetic into the reduced logs of a fleet: found how soon, named how well.

Usage: scripts/benchmarks/fleet_power.py FLEET OUT [--arms 12]

FLEET is a folder of `fleet_maker.py`, OUT that of `ident fleet` on it with --robot wam7.yaml. A
change d of the parameters adds X d to the torque, which is N d in a log's score. Arms that the
maker has changed are left out. The odds asked for are those of one change among 200 arms.
"""

import argparse
import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from ident.fleet.arm_type import ArmType
from ident.fleet.changes import changes, evidence
from ident.fleet.hierarchy import learned
from ident.fleet.metadata import Rules
from ident.fleet.normal import Information
from ident.fleet.series import Entry, Series
from ident.fleet.settings import DEFAULT
from ident.fleet.sources import found_logs
from ident.fleet.store import Store, key_of
from ident.recordings.loading import Reading, fingerprint
from wamctl.arm.config import find_file

NAMES = {"friction": "parameter", "zero": "encoder_offset"}
KINDS = ("friction", "stribeck", "payload", "zero")
LEAST = np.log(200 / DEFAULT.false_alarm_share)
LOAD = [0.5, 0.01, -0.005, 0.03, 0.0025, 0, 0, 0.0025, 0, 0.0004]


def step(kind: ArmType, mean: np.ndarray, what: str, joint: int, sign: float) -> np.ndarray:
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
        d[kind.places[("zero", joint)][0]] = 0.02 * sign
    return d


def main() -> None:
    """Plants, tests and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fleet", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--arms", type=int, default=12)
    given = parser.parse_args()
    robot = find_file(Path("wam7.yaml")).resolve()
    key = key_of(fingerprint(robot), Reading(), DEFAULT.reduction)
    store = Store(given.out / "reduced", key)
    told = {p["arm"] for p in json.loads((given.fleet / "planted.json").read_text("utf-8"))}
    arms: dict[str, list[Entry]] = defaultdict(list)
    for source in found_logs([str(given.fleet / "logs")]):
        stored = store.known(source)
        said = Rules().said(source, stored.reduced.metadata, stored.reduced.first_ns)
        if said.arm not in told:
            arms[said.arm].append(Entry(stored, **vars(said)))
    kind = store.arm_type(next(iter(arms.values()))[0].stored.reduced.type)
    sample = [[e.data(24.0) for e in logs[:: max(1, len(logs) // 16)]] for logs in arms.values()]
    known = learned(sample, kind, 24.0, DEFAULT.type_rounds)
    rng, once = np.random.default_rng(0), replace(DEFAULT, changes=1)
    found = defaultdict(list)
    for arm, entries in list(arms.items())[: given.arms]:
        series = Series(arm, tuple(entries), kind, known, DEFAULT)
        logs, looked = series.information(), series.candidates()
        quiet = evidence(logs, known.mean, known.D, looked, DEFAULT).max()
        print(f"{arm}: highest log odds without a change {quiet:.1f}, asked for {LEAST:.1f}")
        for what in KINDS:
            day, joint = int(rng.integers(8, 28)), int(rng.integers(2, 6))
            d = step(kind, known.mean, what, joint, rng.choice([-1.0, 1.0]))
            after = [Information(x.N, x.y + x.N @ d) for x in logs[day : day + 8]]
            plan = [*logs[:day], *after]
            (first, *_) = [*changes(plan, known.mean, known.D, looked, LEAST, once), None]
            right = first is not None and first.candidate.name == NAMES.get(what, what)
            right = right and (what == "payload" or first.candidate.joints == (joint,))
            found[what].append((joint, None if first is None else first.told - day, right))
    for what, cases in found.items():
        soon = sum(days is not None and days < 7 for _, days, _ in cases)
        missed = [joint for joint, days, _ in cases if days is None]
        named = sum(right for *_, right in cases)
        print(f"{what}: {soon} of {len(cases)} within 7 days, {named} named; missed at {missed}")


if __name__ == "__main__":
    main()
