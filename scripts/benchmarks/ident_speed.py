"""Speed of the feasible fit beside the paper's solver, on the same W and the same feasible set.

Usage: OMP_NUM_THREADS=1 python scripts/benchmarks/ident_speed.py LOG.mcap [--runs N]

SDPA is called through cvxpy, as its users do; it needs the package sdpa-python, for this script.
Times are medians of one run of the script, problem building included. A time counts only where the
objective beside it is that of the others.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import cvxpy as cp
import numpy as np

from ident.evidence import gather
from ident.feasible_fit import feasible, parameter_scale
from ident.feasible_set import unpacked
from ident.problem import Problem, least_error, ordinary, with_beta
from ident.recordings import Reading, read_logs
from ident.regression import squared_error

_BOX = 1e5
"""Bound of the scaled unknowns: SDPA needs one, since many delta have the same beta."""


def through_cvxpy(problem: Problem, solver: str) -> np.ndarray:
    """Base parameters of (44), shape (b,), by a solver behind cvxpy."""
    base = problem.base
    scale = parameter_scale(base.parameters, problem.sizes)
    start = with_beta(base, problem.prior, ordinary(problem))
    G = problem.R[:-1, :-1] @ (base.K * scale) / np.sqrt(least_error(problem))
    x = cp.Variable(len(scale))
    limits = [cp.abs(x) <= _BOX]
    for k in problem.constraints:
        inside = (k.A * scale) @ x - (k.b - k.A @ start)
        if not k.side:
            limits.append(inside >= 0)
            continue
        basis = [unpacked(e, k.side) for e in np.eye(len(k.b))]
        limits.append(sum(inside[i] * part for i, part in enumerate(basis)) >> 0)
    cp.Problem(cp.Minimize(cp.sum_squares(G @ x)), limits).solve(solver=solver)
    return base.K @ (start + scale * x.value)


def median_seconds(fit: Callable[[], np.ndarray], runs: int) -> tuple[float, np.ndarray]:
    """Median time of a fit, and its last answer."""
    seconds, beta = [], np.empty(0)
    for _ in range(runs):
        begin = time.perf_counter()
        beta = fit()
        seconds.append(time.perf_counter() - begin)
    return float(np.median(seconds)), beta


def main() -> None:
    """Print one line per solver."""
    parser = argparse.ArgumentParser(description="Speed of the feasible fit beside SDPA's.")
    parser.add_argument("log", type=Path)
    parser.add_argument("--runs", type=int, default=7)
    arguments = parser.parse_args()
    arm, data = read_logs([arguments.log], None, Reading())
    problem = gather(data, arm).problem()
    fits: dict[str, Callable[[], np.ndarray]] = {
        "ours (Clarabel, built by hand)": lambda: feasible(problem).beta,
        "Clarabel through cvxpy": lambda: through_cvxpy(problem, cp.CLARABEL),
    }
    if "SDPA" in cp.installed_solvers():
        fits["SDPA through cvxpy"] = lambda: through_cvxpy(problem, cp.SDPA)
    else:
        sys.stderr.write("SDPA is left out: pip install sdpa-python\n")
    found = {name: median_seconds(fit, arguments.runs) for name, fit in fits.items()}
    base_seconds, base_beta = found["ours (Clarabel, built by hand)"]
    least = float(squared_error(problem.R, base_beta))
    for name, (seconds, beta) in found.items():
        error = float(squared_error(problem.R, beta))
        sys.stdout.write(
            f"{name:32s} {1e3 * seconds:8.1f} ms  {seconds / base_seconds:6.1f} x"
            f"  objective {error:.6f} ({error / least - 1:+.1e})\n"
        )


if __name__ == "__main__":
    main()
