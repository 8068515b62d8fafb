"""Blind benchmark of `ident gap --method simulation` where recordings hold torque.

Run: .venv/bin/python scripts/benchmarks/driven_naming.py [--runs N] [--seed S] [--hidden 0|1]
     [--family F].. [--scale X]

The arms, their friction, which turns round in eight ways, and the effects are those of
`gap_naming.py`; each log is identified and searched by simulation. Prints a line a run: what was
hidden, what was said, sizes with standard deviations, and how many base parameters by simulation
and by regression are within two standard errors of each other.
"""

import argparse
import time

from gap_cases import run

from ident.gap.data.experiment import experiment
from ident.output_error.missing.kinds import KINDS
from ident.output_error.search.settings import SearchSettings
from ident.workflows.output_error.driven_gap import driven_gap
from ident.workflows.run import run_data


def main() -> None:
    """Print a line for each run, then how many were right."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--runs", type=int, default=5)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--hidden", type=int, choices=(0, 1), default=1)
    options.add_argument("--family", action="append", help="hide one of these only")
    options.add_argument("--scale", type=float, default=1.0)
    chosen = options.parse_args()
    families = chosen.family or [k.name for k in KINDS]
    counts: dict[str, int] = {}
    for seed in range(chosen.seed, chosen.seed + chosen.runs):
        try:
            recorded = run(seed, chosen.hidden, chosen.scale, families)
        except ValueError as error:
            print(f"{seed:6d} not recorded: {error}", flush=True)
            continue
        began = time.process_time()
        source = experiment([recorded.log], ["log"])
        done = driven_gap(run_data(source.arm, source.datasets), SearchSettings())
        content = done.content
        hidden = [
            (c.answer, [j + 1 for j in c.joints], float(f"{c.size:.3g}")) for c in recorded.cases
        ]
        named = [(e["name"], e["joints"]) for e in content["effects"]]
        sizes = [
            {k: f"{p['value']:.4g} ± {p['sd'] or 0.0:.2g}" for k, p in e["parameters"].items()}
            for e in content["effects"]
        ]
        right = all(any(n == a and set(j) <= set(at) for n, j in named) for a, at, _ in hidden)
        word = "right" if right and len(named) == len(hidden) else "other"
        word = word if named or not hidden else "silent"
        word += "" if content["verdict"] != "unknown" else ", something left"
        counts[word] = counts.get(word, 0) + 1
        agree = "{} of {}".format(*done.simulated.agreeing)
        seconds = time.process_time() - began
        print(
            f"{seed:6d} {hidden or 'nothing'} told: {content['verdict']} {named} {sizes}"
            f" | agree {agree} | {word} ({seconds:.0f} s)",
            flush=True,
        )
    print(counts)


if __name__ == "__main__":
    main()
