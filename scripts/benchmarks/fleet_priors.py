#!/usr/bin/env -S .venv/bin/python
"""What arms borrow from their type: standard errors with and without, and whether they are honest.

Usage: scripts/benchmarks/fleet_priors.py FLEET OUT [--arms 10] [--seed 0]

FLEET is a folder of `fleet_maker.py` made with --seed, OUT that of `ident fleet` on it with --robot
wam7.yaml. The type is learned from some arms, others are judged by it, from one of five logs. The
planted truth is that of links and zeros; friction is made in a form of its own, and is compared
with what later logs of the arm say without any prior.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from fleet_maker import WAM, arm, find_file, load_robot
from fleet_reduced import unchanged
from numpy.typing import NDArray

from ident.estimation.problem import prior_parameters
from ident.fleet.arm_type import ArmType
from ident.fleet.columns import Columns
from ident.fleet.fleet import even
from ident.fleet.hierarchy import TypeStatistics, learned, log_information, louder
from ident.fleet.normal import Information, nothing, posterior
from ident.fleet.reduce import with_offset
from ident.fleet.series import Entry
from ident.fleet.settings import DEFAULT
from ident.model.arm import arm_from_file

Array = NDArray[np.floating]

FIFTH, REST = 1, 4  # logs
FLAT = 1e6  # times the variance between arms
LEVEL = 1.645  # of an interval that holds 90 %
WARM_C = 24.0


def summed(logs: list[Entry], kind: ArmType, known: TypeStatistics) -> Information:
    """What some logs say together."""
    said = nothing(len(kind.names))
    for log in louder([log.data(WARM_C) for log in logs], known.own):
        said = said + log_information(log, kind, known)
    return said


@dataclass(frozen=True)
class Judged:
    """One arm: values and standard errors of the p parameters, from one log if not said otherwise.

    Attributes:
        own: without the type, values and standard errors.
        helped: with it.
        five: standard errors without the type, from five logs.
        other: values and standard errors from other logs, without the type.
        truth: what was planted, NaN where it has no number.
    """

    own: tuple[Array, Array]
    helped: tuple[Array, Array]
    five: Array
    other: tuple[Array, Array]
    truth: Array


def judged(logs: list[Entry], kind: ArmType, known: TypeStatistics, truth: Array) -> Judged:
    """An arm's parameters with and without its type."""

    def said(chosen: list[Entry], wider: float) -> tuple[Array, Array]:
        x, V = posterior(summed(chosen, kind, known), known.mean, wider * known.D)
        return x, np.sqrt(np.diag(V))

    fifth = logs[:FIFTH]
    five = said(logs[: FIFTH + REST], FLAT)[1]
    return Judged(
        said(fifth, FLAT), said(fifth, 1.0), five, said(logs[FIFTH + REST :], FLAT), truth
    )


class Planted:
    """The truth of the maker's arms, in the columns of their type."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._robot = load_robot(find_file(Path("wam7.urdf")).read_text(encoding="utf-8"), WAM)
        own = with_offset(arm_from_file(find_file(Path("wam7.yaml")).resolve(), ()))
        self._columns = Columns(own, DEFAULT.stribeck_speeds_rad_s)

    def of(self, name: str) -> Array:
        """Values, shape (p,); NaN for friction."""
        columns, model = self._columns, self._columns.arm.robot.model.copy()
        rng = np.random.default_rng((self._seed, int(name.removeprefix("arm"))))
        made = arm(self._robot.model.copy(), rng)
        for k, inertia in enumerate(made.inertias, 1):
            model.inertias[k] = inertia
        robot = replace(columns.arm.robot, model=model)
        found = np.full(columns.count, np.nan)
        links = columns.base.K @ prior_parameters(robot, columns.base)
        for place, column in enumerate(columns.names):
            if column.kind == "inertial":
                found[place] = links[place]
            elif column.kind == "ia":
                found[place] = 0.0
            elif column.kind == "zero":
                found[place] = made.zero[column.joint - 1]
        return found


def covered(values: Array, sds: Array, truth: Array) -> str:
    """The share of 90 % intervals that hold the truth."""
    there = np.isfinite(truth)
    inside = np.abs(values - truth)[there] <= LEVEL * sds[there]
    return f"{100 * inside.mean():.0f} % of {inside.size}"


def main() -> None:
    """Learns from some arms, judges others, prints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fleet", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--arms", type=int, default=10, help="that are judged")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    store, arms = unchanged(given.fleet, given.out)
    names = sorted(arms)
    judge, teach = names[: given.arms], names[given.arms :][: DEFAULT.type_arms]
    kind = store.arm_type(arms[names[0]][0].stored.reduced.type)
    sample = [[e.data(WARM_C) for e in even(arms[a], DEFAULT.type_logs)] for a in teach]
    known = learned(sample, kind, WARM_C, DEFAULT.type_rounds)
    planted = Planted(given.seed)
    found = [judged(arms[a], kind, known, planted.of(a)) for a in judge]
    own, five = (np.array([f(j) for j in found]) for f in (lambda j: j.own[1], lambda j: j.five))
    helped = np.array([j.helped[1] for j in found])
    size = np.sqrt(known.mean**2 + known.D)
    relative = np.median(five, axis=0) / size
    worst = relative >= np.quantile(relative, 0.75)
    print(f"type from {len(teach)} arms, {len(judge)} others judged, {len(size)} parameters")
    for what, rows in (("worst-seen quarter", worst), ("all", np.ones(len(size), bool))):
        ratios = (helped / own)[:, rows], (helped / five)[:, rows]
        print(
            f"{what} ({rows.sum()}): with the type beside without, one log"
            f" {np.median(ratios[0]):.2f}; with the type, one log, beside without, five logs"
            f" {np.median(ratios[1]):.2f} (medians)"
        )
        truth = np.array([j.truth for j in found])[:, rows]
        held = [np.array([j.helped[k] for j in found])[:, rows] for k in (0, 1)]
        print(f"  90 % intervals hold the planted truth: {covered(held[0], held[1], truth)}")
        bare = [np.array([j.own[k] for j in found])[:, rows] for k in (0, 1)]
        print(f"  without the type: {covered(bare[0], bare[1], truth)}")
        later = [np.array([j.other[k] for j in found])[:, rows] for k in (0, 1)]
        both = np.hypot(held[1], later[1])
        print(f"  they hold what the arm's later logs say: {covered(held[0], both, later[0])}")
    names_of = [kind.names[k].text for k in np.flatnonzero(worst)]
    print("worst seen:", ", ".join(names_of))


if __name__ == "__main__":
    main()
