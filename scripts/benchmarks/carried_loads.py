"""Loads that are picked up and put down in recordings: which are told, and what of right ones.

Run: .venv/bin/python scripts/benchmarks/carried_loads.py LOG.. --mass KG [--robot FILE]

Adds the torque of a point mass at the last link, 0.1 m from its frame, to a part of each recording:
KG from 30 and from 60 % of its time to the end, and in between; twice as much from 40 to 80 %; half
as much less from the middle on. Prints what `ident run` says of each, and of the recording as it
is. The torque is Pinocchio's, along the smoothed positions.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.signal import savgol_filter

from ident.checks.examine import examine
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset, Segment
from ident.recordings.loading import Reading
from ident.workflows.run import read_logs

PLACES = ((1.0, 0.3, 1.0), (1.0, 0.6, 1.0), (1.0, 0.3, 0.6), (2.0, 0.4, 0.8), (-0.5, 0.5, 1.0))
"""Mass in those asked for, and from which part of the time to which."""

CENTRE = np.array([0.02, 0.0, 0.1])
SMOOTH_S = 0.1


def loaded(data: Dataset, arm: Arm, mass: float, start: float, end: float) -> Dataset:
    """A recording with a mass [kg] at the last link for a part of its time."""
    return replace(data, read=partial(_read, data, arm, mass, (start, end)))


def _read(
    data: Dataset, arm: Arm, mass: float, when: tuple[float, float]
) -> Iterator[tuple[int, Segment]]:
    first, last = data.span_s
    model = pin.Model(arm.robot.model)
    for k in range(model.njoints):
        model.inertias[k] = pin.Inertia.Zero()
    placement = pin.SE3(arm.robot.parameter_placements[-1])
    model.inertias[model.njoints - 1] = placement.act(pin.Inertia(mass, CENTRE, np.zeros((3, 3))))
    state = model.createData()
    for number, part in data.read():
        window = max(5, int(SMOOTH_S * data.rate_hz) // 2 * 2 + 1)
        if len(part.q) <= window:
            yield number, part
            continue
        step = 1.0 / data.rate_hz
        qd, qdd = (savgol_filter(part.q, window, 3, deriv=d, delta=step, axis=0) for d in (1, 2))
        share = (part.start_s + step * np.arange(len(part.q)) - first) / (last - first)
        tau = part.tau.copy()
        for s in np.flatnonzero((share >= when[0]) & (share < when[1])):
            tau[s] += pin.rnea(model, state, part.q[s], qd[s], qdd[s])
        yield number, replace(part, tau=tau)


def told(arm: Arm, data: Dataset) -> str:
    """What is said of a load that comes or goes; empty for nothing."""
    remarks = examine(arm, [data]).remarks
    return " ".join(r.finding for r in remarks if r.code == "load_changes")


def main() -> None:
    """Print what is told."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("logs", type=Path, nargs="+")
    options.add_argument("--mass", type=float, required=True, help="[kg]")
    options.add_argument("--robot", type=Path, help="the arm's file")
    chosen = options.parse_args()
    found = 0
    for log in chosen.logs:
        arm, (data,) = read_logs([log], chosen.robot, Reading())
        print(f"{log.name}, as it is: {told(arm, data) or '-'}")
        for factor, start, end in PLACES:
            said = told(arm, loaded(data, arm, factor * chosen.mass, start, end))
            found += bool(said)
            what = f"{factor * chosen.mass:g} kg, {100 * start:.0f} to {100 * end:.0f} %"
            print(f"{log.name}, {what}: {said or '-'}", flush=True)
    print(f"{found} of {len(PLACES) * len(chosen.logs)} loads told")


if __name__ == "__main__":
    main()
