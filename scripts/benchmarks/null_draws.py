"""Thousands of effect-free data sets of one arm: how often does noise alone reach a threshold?

Run: .venv/bin/python scripts/benchmarks/null_draws.py LOG.. [--draws 3000] [--seed 0]

Each log is searched once. Then its residual is drawn again, with its spectrum and random phases,
and every single-joint candidate is scored on each draw beside the model that was found, as the
search scores them first, against the threshold that the search would ask for: the least gain, or
what 100 other draws reach in 99 %. No later test of the search is run, so that the rate is above
that of names. Prints, for each log, the draws in which any effect reached its threshold, and the
bound of the rate (Clopper and Pearson 1934, 95 %, one-sided).
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from ident.gap.data.blocks import SEARCHED
from ident.gap.data.experiment import read_experiment
from ident.gap.nulls.null_arms import phase_randomised
from ident.gap.options import Options
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.residuals import residuals
from ident.gap.regression.weighted_fit import Fit, fit
from ident.gap.search import search
from ident.gap.selection.candidates import all_candidates
from ident.gap.selection.scoring import noise_gains

CHUNK = 250
CHANCE = 100


def gains(
    design: DesignMatrix, now: Fit, count: int, rng: np.random.Generator
) -> dict[str, NDArray[np.float64]]:
    """Largest gain of each effect in each of some draws, each of shape (count,)."""
    searched = np.isin(design.fold, SEARCHED)
    left = residuals(design, now)
    parts = []
    for first in range(0, count, CHUNK):
        size = min(CHUNK, count - first)
        draws = []
        for r in left:
            drawn = [phase_randomised(r, rng) for _ in range(size)]
            draws.append(np.column_stack(drawn) * searched[: len(r.values), None])
        parts.append(noise_gains(design, now, draws))
    return {effect: np.concatenate([p[effect] for p in parts]) for effect in parts[0]}


def alarms(log: Path, count: int, seed: int) -> int:
    """Draws of a log in which any effect reaches its threshold."""
    options = Options()
    found = search(read_experiment([log]), options, lambda _: None)
    end, thresholds = found.end, options.settings.thresholds
    design = end.design(found.rows, all_candidates(end.model.facts))
    now = fit(design.equations.of(SEARCHED), end.fit.structure, end.fit.sigma)
    rng = np.random.default_rng(seed)
    chance = gains(design, now, CHANCE, rng)
    drawn = gains(design, now, count, rng)
    asked = {
        effect: max(thresholds.min_gain, float(np.quantile(values, thresholds.chance_quantile)))
        for effect, values in chance.items()
    }
    reached = np.any([drawn[effect] >= least for effect, least in asked.items()], axis=0)
    largest = max(drawn, key=lambda effect: drawn[effect].max() / asked[effect])
    share = drawn[largest].max() / asked[largest]
    print(
        f"{log.name}: {reached.sum()} of {count}; nearest {largest}, {share:.2f} of its threshold"
    )
    return int(reached.sum())


def main() -> None:
    """Print the draws that reach a threshold."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("logs", type=Path, nargs="+")
    options.add_argument("--draws", type=int, default=3000, help="of all logs together")
    options.add_argument("--seed", type=int, default=0)
    chosen = options.parse_args()
    each = chosen.draws // len(chosen.logs)
    total = sum(alarms(log, each, chosen.seed + i) for i, log in enumerate(chosen.logs))
    drawn = each * len(chosen.logs)
    most = float(beta.ppf(0.95, total + 1, drawn - total)) if total < drawn else 1.0
    print(f"all: {total} of {drawn}, a rate of {100 * most:.2f} % at most")


if __name__ == "__main__":
    main()
