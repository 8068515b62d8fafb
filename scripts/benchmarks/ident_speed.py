"""Speed of the fit beside the paper's solver and beside FIGAROH, in one run.

Usage: OMP_NUM_THREADS=1 python scripts/benchmarks/ident_speed.py LOG.mcap [--runs N]

The feasible solve, problem building included: ours, Clarabel through cvxpy, and SDPA (the paper's
solver, package sdpa-python) through cvxpy, on the same W and the same feasible set, in the paper's
variables (beta, delta_d) with beta in units of its own noise. A time counts only where the
objective beside it is that of the others.

The whole fit, from the log's samples in memory to possible parameters (filter, regressor,
reduction, base parameters, feasible solve): ours, and FIGAROH's (package figaroh 1.0.2) by its
class for it, with `select_stage: physical_fit`, our cut-off, and its defaults, which thin the rows
as far as ours are. It uses the same pseudo-inertia matrices, and stays near CAD.

Both packages are extras for this script; what is not installed is left out. The programs take
turns, and times are medians, so that a busy machine slows all alike; beside them stands processor
time, which other work on the machine hardly changes.
"""

import argparse
import contextlib
import io
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import cvxpy as cp
import numpy as np

from ident.estimation.feasible_sdp import feasible
from ident.estimation.problem import Problem
from ident.estimation.readable_sdp import feasible_program
from ident.estimation.regression_data import reduce_recordings
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset, in_memory
from ident.recordings.loading import Reading, read_logs
from ident.regression.filters import processing
from ident.regression.triangles import squared_error

OURS = "ours"


def through_cvxpy(problem: Problem, solver: str) -> np.ndarray:
    """Base parameters of the feasible fit, shape (b,), by a solver behind cvxpy.

    Args:
        problem: the reduced regression.
        solver: cvxpy's name for it.
    """
    return feasible_program(problem).solve(solver).beta


def figaroh_fit(arm: Arm, data: Dataset) -> str:
    """What FIGAROH says of its physical fit.

    Raises:
        RuntimeError: it finds no possible parameters.
    """
    from figaroh.identification.base_identification import BaseIdentification
    from figaroh.identification.config import PHYSICAL_FIT_DEFAULTS

    (segment,) = data.segments
    used, model = slice(*(segment.used or (0, None))), arm.robot.model
    process = processing(arm, data)
    joints = list(range(model.nv))

    class Fit(BaseIdentification):
        def load_param(self, config_file, setting_type="identification"):
            self.identif_config = {
                "has_friction": True,
                "is_joint_torques": True,
                "active_joints": list(model.names)[1:],
                "act_idxq": joints,
                "act_idxv": joints,
                "fv": [0.0] * model.nv,
                "fs": [0.0] * model.nv,
                "select_stage": "physical_fit",
                "physical_fit": dict(PHYSICAL_FIT_DEFAULTS),
                "filter_config": {
                    "differentiation_method": "gradient",
                    "filter_params": {
                        "f_sample": data.rate_hz,
                        "f_butter": process.cutoff_hz,
                    },
                },
            }

        def load_trajectory_data(self, data_source=None):
            q, tau = segment.q[used], segment.tau[used]
            t = np.arange(len(q)) / data.rate_hz
            return {"timestamps": t, "positions": q, "torques": tau}

    still = np.zeros(model.nv)
    robot = SimpleNamespace(model=model, data=model.createData(), q0=still, v0=still)
    with contextlib.redirect_stdout(io.StringIO()):
        fit = Fit(robot)
        fit.initialize()
        fit.solve(decimation_factor=process.row_every, plotting=False)
    record = fit.result["physical_fit"]
    if record["status"] != "accepted":
        raise RuntimeError(f"FIGAROH: {record['reason']}")
    return record["reason"]


@dataclass(frozen=True)
class Timed:
    """Median times of a fit: on the clock, and of the processor [s]; its last answer."""

    wall_s: float
    cpu_s: float
    answer: object


def timed(fits: dict[str, Callable[[], object]], runs: int) -> dict[str, Timed]:
    """Each fit so many times, taking turns."""
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in fits}
    answers: dict[str, object] = {}
    for _ in range(runs):
        for name, fit in fits.items():
            wall, cpu = time.perf_counter(), time.process_time()
            answers[name] = fit()
            spent[name].append((time.perf_counter() - wall, time.process_time() - cpu))
    medians = {name: np.median(s, axis=0).tolist() for name, s in spent.items()}
    return {name: Timed(*medians[name], answers[name]) for name in fits}


def line(name: str, found: Timed, ours: Timed, more: str) -> None:
    """Print the times and what they are beside ours."""
    wall, cpu = found.wall_s / ours.wall_s, found.cpu_s / ours.cpu_s
    sys.stdout.write(
        f"  {name:24s} {1e3 * found.wall_s:8.1f} ms {wall:6.1f} x"
        f" {1e3 * found.cpu_s:8.1f} ms CPU {cpu:6.1f} x  {more}\n"
    )


def main() -> None:
    """Print one line per solver, and one per program."""
    parser = argparse.ArgumentParser(description="Speed of the fit beside SDPA and FIGAROH.")
    parser.add_argument("log", type=Path)
    parser.add_argument("--runs", type=int, default=7)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")  # cvxpy's, on the last digits
    arm, (log,) = read_logs([arguments.log], None, Reading())
    data = in_memory(log, log.rate_hz, log.segments)
    problem = reduce_recordings([data], arm).problem()
    fits: dict[str, Callable[[], object]] = {
        OURS: lambda: feasible(problem).beta,
        "Clarabel through cvxpy": lambda: through_cvxpy(problem, cp.CLARABEL),
    }
    if "SDPA" in cp.installed_solvers():
        fits["SDPA through cvxpy"] = lambda: through_cvxpy(problem, cp.SDPA)
    found = timed(fits, arguments.runs)
    least = float(squared_error(problem.R, np.asarray(found[OURS].answer)))
    sys.stdout.write("the feasible solve, problem building included\n")
    for name, one in found.items():
        error = float(squared_error(problem.R, np.asarray(one.answer)))
        line(name, one, found[OURS], f"objective {error:.6f} ({error / least - 1:+.1e})")
    programs: dict[str, Callable[[], object]] = {
        OURS: lambda: feasible(reduce_recordings([data], arm).problem()).status
    }
    if find_spec("figaroh"):
        programs["FIGAROH's physical_fit"] = lambda: figaroh_fit(arm, data)
    found = timed(programs, max(1, arguments.runs // 2))
    sys.stdout.write("the whole fit\n")
    for name, one in found.items():
        line(name, one, found[OURS], str(one.answer))


if __name__ == "__main__":
    main()
