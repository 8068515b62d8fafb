"""Two joints that torque drives, moved by MuJoCo, with a spring in the elbow's gears or without.

Run: .venv/bin/python scripts/benchmarks/driven_springs.py [--runs N] [--seed S] [--springs]

Friction, how softly MuJoCo lets it turn round, the motion and its length (12, 18 or 30 s) are
drawn; a spring has 40 or 100 N m/rad. Prints what the search along recorded torque says, and how
many base parameters by simulation and by regression are within two standard errors.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

import ident
from ident.output_error.search.settings import SearchSettings
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.workflows.output_error.driven_gap import driven_gap
from ident.workflows.run import run_data

sys.path.append(str(Path(__file__).parents[2] / "tests" / "unit" / "output_error"))
import driven_arm


def main() -> None:
    """Print a line for each arm."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--runs", type=int, default=10)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--springs", action="store_true")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "two.urdf"
        urdf.write_text(driven_arm.URDF, encoding="utf-8")
        arm = ident.Arm.from_urdf(urdf)
        for seed in range(chosen.seed, chosen.seed + chosen.runs):
            rng = np.random.default_rng([5, seed])
            seconds = float(rng.choice([12.0, 18.0, 30.0]))
            softness = float(rng.choice([5e-4, 2e-3, 1e-2]))
            viscous, coulomb = rng.uniform(0.1, 0.6), rng.uniform(0.05, 0.4)
            friction = driven_arm.friction_of(viscous, coulomb, softness)
            stiffness = float(rng.choice([40.0, 100.0])) if chosen.springs else None
            log = driven_arm.recording(seconds, seed, stiffness, friction).log
            described = arm.of_recording(log.joint_names)
            data = dataset_for(described, summarise_log(log, "log"))
            done = driven_gap(run_data(described, [data]), SearchSettings())
            named = [(e["name"], e["joints"], e["parameters"]) for e in done.content["effects"]]
            spring = "nothing" if stiffness is None else f"1/{stiffness:g} rad/(N m) at joint 2"
            within, known = done.simulated.agreeing
            print(
                f"{seed:5d} {seconds:g} s, {spring}: {done.content['verdict']} {named};"
                f" agree {within} of {known}",
                flush=True,
            )


if __name__ == "__main__":
    main()
