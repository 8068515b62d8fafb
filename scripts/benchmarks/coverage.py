"""How often the 90 % intervals of `ident run` hold the truth.

Run: .venv/bin/python scripts/benchmarks/coverage.py own|plant|foreign [--arms N] [--seed S]

`own`: simulated WAM arms with links and friction drawn anew, recorded by `wamctl excite` in
lockstep. `plant`: the same arms without their bus (`own_plant.py`), ten times faster; positions
differ by an encoder's steps. `foreign`: arms of this benchmark's own simulation, each joint of
which turns round as the tool does not hold: with an algebraic tail, along an arctangent, as Dahl,
or as LuGre. All follow the shipped motion for three periods. Counted apart: all 57 base parameters,
and the 14 of friction; `ols` and `feasible` have the same intervals. `--keep` keeps the logs of
`own` for another run, `--table` appends each arm's errors to a file, a line of JSON an arm. Seeds
below 100 are for development.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from gap_cases import MOTION
from gap_plants import ALGEBRAIC, ARCTANGENT, DAHL, LUGRE, TAILED, Body, Hidden, Noise, record
from numpy.typing import NDArray
from own_plant import cell, recorded

from ident.identification.identify import Identification, identify
from ident.identification.standard_errors import QUANTILE_90
from ident.model.arm import Arm, arm_from_file, arm_from_log
from ident.recordings.dataset import Dataset, dataset
from ident.recordings.loading import Reading, read_logs
from ident.recordings.steady_state import only_steady_state
from sim_bus.assembly import load_simulation
from sim_bus.plant.truth import Truth
from wamctl.arm.config import load_arm_file, shipped_file
from wamctl.arm.recording import Recording
from wamctl.arm.robot import cad_parameters
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import Trajectory, read_trajectory, reference, trajectory_yaml

Array = NDArray[np.floating]

PERIODS = 3
SHAPES = (DAHL, LUGRE, TAILED, ALGEBRAIC, ARCTANGENT)
BRISTLES = (DAHL, LUGRE)
SPREAD = 0.4  # of the logarithm of each friction value


@dataclass(frozen=True)
class Case:
    """A recorded arm and its truth.

    Attributes:
        arm, data: as `ident run` reads them.
        delta: inertial parameters, shape (10 n,).
        friction: `fv` and `fc`, each of shape (n,).
    """

    arm: Arm
    data: Dataset
    delta: Array
    friction: dict[str, Array]

    def truth(self, found: Identification) -> Array:
        """True base parameters, shape (b,)."""
        links = iter(self.delta)
        base = found.evidence.base
        return base.K @ np.array(
            [
                next(links) if p.kind == "inertial" else self.friction[p.kind][p.index - 1]
                for p in base.parameters
            ]
        )


def own(seed: int, folder: Path) -> Case:
    """A simulated WAM on the bus, recorded by the driver."""
    arm_file, log = cell(folder, seed, SPREAD), folder / f"own{seed}.mcap"
    if not log.exists():
        new = folder / f"unfinished{seed}.mcap"
        command = [Path(sys.executable).parent / "wamctl", "excite", "--config", arm_file.path]
        options = ["--bus", "sim", "--lockstep", "--seed", str(seed), "--out", new]
        subprocess.run([*command, *options], check=True, capture_output=True)
        new.rename(log)
    arm, (data,) = read_logs([log], None, Reading())
    return _with_truth(arm, data, load_simulation(arm_file.path, seed).truth)


def plant(seed: int, folder: Path) -> Case:
    """The same arm without its bus."""
    arm_file = cell(folder, seed, SPREAD)
    log = recorded(arm_file, MOTION, PERIODS)
    return _with_truth(*_read(log), load_simulation(arm_file.path, seed).truth)


def _with_truth(arm: Arm, data: Dataset, truth: Truth) -> Case:
    return Case(arm, data, truth.delta, {"fv": truth.viscous, "fc": truth.coulomb})


def _read(log: Recording) -> tuple[Arm, Dataset]:
    """A recording as `ident run` reads it."""
    arm = arm_from_log(log, "log")
    return arm, only_steady_state(dataset(log, arm.robot.joint_names, "log"), log, "log")


def foreign(seed: int, _: Path) -> Case:
    """An arm whose friction turns round otherwise."""
    rng = np.random.default_rng(seed)
    file = load_arm_file("wam7.yaml")
    excitation = read_trajectory(MOTION)
    motion = reference(excitation.series, PERIODS, file.excitation.ramp_s, file.bus.period_s)
    inside = {
        "config.yaml": shipped_file("wam7.yaml").read_bytes(),
        "robot.urdf": shipped_file("wam7.urdf").read_bytes(),
        "trajectory.yaml": trajectory_yaml(Trajectory(excitation.series, PERIODS, {}, {})).encode(),
    }
    fv, fc = (
        np.array(size) * np.exp(rng.uniform(-SPREAD, SPREAD, 7))
        for size in (file.simulation.viscous_nm_s_rad, file.simulation.coulomb_nm)
    )
    kinds = rng.choice(SHAPES, 7)
    distance = rng.uniform(1e-4, 6e-4, 7)
    scale = np.where(np.isin(kinds, BRISTLES), distance, rng.uniform(3e-3, 1.2e-2, 7))
    robot = arm_from_file(shipped_file("wam7.yaml"), ()).robot
    links = cad_parameters(robot).reshape(7, 10) * (1 + rng.uniform(-0.08, 0.08, (7, 1)))
    body = Body(links.ravel(), fv, fc, kinds, scale)
    log = record(file, robot, body, Hidden(), Noise(2e-3 * fc, 0.05), motion, seed)
    series = ReferenceSeries(log.stamp_ns, motion.q, motion.qd, motion.qdd)
    log = replace(log, reference=series, attachments=inside)
    arm, data = _read(log)
    return Case(arm, data, links.ravel(), {"fv": fv, "fc": fc})


def held(case: Case) -> tuple[Array, NDArray[np.bool_]]:
    """Errors of ols and feasible in standard errors, shape (2, b), and which are friction's."""
    found = identify([case.data], case.arm)
    truth = case.truth(found)
    friction = [p.kind != "inertial" for p in found.evidence.base.kept_parameters]
    errors = [(found.estimates[n].beta - truth) / found.sd for n in ("ols", "feasible")]
    return np.array(errors), np.array(friction)


def main() -> None:
    """Print a line for each arm, then the shares."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("kind", choices=("own", "plant", "foreign"))
    options.add_argument("--arms", type=int, default=20)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--keep", type=Path)
    options.add_argument("--table", type=Path)
    chosen = options.parse_args()
    kinds: dict[str, Callable[[int, Path], Case]]
    kinds = {"own": own, "plant": plant, "foreign": foreign}
    errors, friction = [], np.zeros(0, dtype=bool)
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for seed in range(chosen.seed, chosen.seed + chosen.arms):
            z, friction = held(kinds[chosen.kind](seed, folder))
            errors.append(z)
            if chosen.table:
                _append(chosen.table, {"kind": chosen.kind, "seed": seed}, z, friction)
            print(f"{seed:5d} {_shares(np.array([z]), friction)}", flush=True)
    print(f"{len(errors)} arms: {_shares(np.array(errors), friction)}")


def _append(path: Path, arm: dict[str, Any], z: Array, friction: NDArray[np.bool_]) -> None:
    line = arm | {"ols": z[0].tolist(), "feasible": z[1].tolist(), "friction": friction.tolist()}
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def _shares(errors: Array, friction: NDArray[np.bool_]) -> str:
    inside = np.abs(errors) < QUANTILE_90
    return ", ".join(
        f"{name} {inside[:, i].mean():.1%} (friction {inside[:, i][:, friction].mean():.1%},"
        f" worst {np.abs(errors[:, i]).max():.1f} sd)"
        for i, name in enumerate(("ols", "feasible"))
    )


if __name__ == "__main__":
    main()
