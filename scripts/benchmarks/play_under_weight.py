"""Whether a motion lets an arm's links cross the play of their gears, or weight holds them.

Run: .venv/bin/python scripts/benchmarks/play_under_weight.py FOLDER [--zero RAD]

FOLDER holds SAGE's tables of the SO-101. A link leaves the flank of its gears where the torque that
its own motion and weight ask of the gears changes sign. For each joint: the range of gravity's
torque over all motions, the whole torque's, and the share of samples in which either has the sign
that it has least often; the worst of zeros shifted by RAD at each joint that lifts. Torques that
stay below the gears' friction at the link do not move it; `--still` sets that [N m].
"""

import argparse
import itertools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

import ident
from ident.dynamics.compiled_chain import chain_of, torques
from ident.importers.recording import mapped_recording
from wamctl.arm.robot import cad_parameters

Array = NDArray[np.floating]

LIFTING = (1, 2, 3)


def rarer(torque: Array, still: float) -> Array:
    """Share of samples on the side that the torque is on least often, by joint."""
    return np.minimum((torque > still).mean(axis=0), (torque < -still).mean(axis=0))


def main() -> None:
    """Print a line for each joint."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--zero", type=float, default=0.15)
    parser.add_argument("--still", type=float, default=0.02)
    asked, moved = parser.parse_args(), []
    for table in sorted(asked.folder.glob("*.csv")):
        recording = mapped_recording(table, "so101-map.yaml")
        period = float(np.median(np.diff(recording.stamp_ns))) * 1e-9
        moved.append([savgol_filter(recording.q, 7, 3, deriv=d, delta=period, axis=0)
                      for d in range(3)])  # fmt: skip
    robot = ident.Arm.from_config("so101.yaml").of_recording(recording.joint_names).robot
    q, v, a = (np.concatenate(x) for x in zip(*moved, strict=True))
    chain, delta = chain_of(robot), cad_parameters(robot)
    weight, whole, shares = [], [], []
    for shift in itertools.product((-asked.zero, 0.0, asked.zero), repeat=len(LIFTING)):
        placed = q.copy()
        placed[:, LIFTING] = q[:, LIFTING] + shift
        held = torques(chain, delta, placed, np.zeros_like(v), np.zeros_like(a))
        needed = torques(chain, delta, placed, v.copy(), a.copy())
        weight.append([held.min(axis=0), held.max(axis=0)])
        whole.append([needed.min(axis=0), needed.max(axis=0)])
        shares.append([rarer(held, asked.still), rarer(needed, asked.still)])
    for j, name in enumerate(robot.joint_names):
        ranges = [
            f"{np.array(x)[:, 0, j].min():6.3f} to {np.array(x)[:, 1, j].max():6.3f} N m"
            for x in (weight, whole)
        ]
        least = 100 * np.array(shares).max(axis=0)[:, j]
        print(f"{name:14s} weight {ranges[0]} ({least[0]:.2f} % of samples on the rarer side),"
              f" with motion {ranges[1]} ({least[1]:.2f} %)")  # fmt: skip


if __name__ == "__main__":
    main()
