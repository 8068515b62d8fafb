"""How often the 90 % intervals of a payload hold, found beside a model that is itself an estimate.

Run: .venv/bin/python scripts/benchmarks/payload_intervals.py [--arms N] [--seed S]

Each arm is a simulated WAM (`own_plant.py`) with links, friction and payload drawn anew. A model is
identified without the payload on two periods of the shipped motion; the payload is fitted beside it
on the same motion, and on another one. Counts are told of what `ident gap` reports, without the
reference's errors, and without what comes again with the motion. Seeds below 4000 are for
development.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml
from exported_arms import SPREAD, identified
from own_plant import MOTION, OTHER_MOTION, cell, recorded

from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import experiment, facts_of
from ident.gap.options import Options
from ident.gap.regression.current_model import extend, nominal_fit
from ident.gap.search import rows_of
from ident.gap.selection.estimates import final_estimates
from ident.identification.standard_errors import QUANTILE_90
from ident.model.identified_model import Model
from wamctl.arm.recording import Recording

NAMES = ("mass", "first_moment_x", "first_moment_y", "first_moment_z")
PERIODS = 2
ROUNDS = 4


def errors(log: Recording, model: Model, true: list[float]) -> np.ndarray:
    """Errors in standard deviations as reported, without the two parts, shape (3, 4)."""
    source, options = replace(experiment([log], ["log"]), reference_model=model), Options()
    rows, facts, payload = rows_of(source, options), facts_of(source), catalogue()["payload"]
    nominal, (found,) = nominal_fit(rows, facts), payload.candidates(facts)
    for _ in range(ROUNDS):
        found = payload.linearised_at(found, extend(rows, nominal, (found,)).fit.effects[0])
    end = extend(rows, nominal, (found,))
    certain = replace(rows, parameter_errors=tuple(x[..., :0] for x in rows.parameter_errors))
    told = []
    for data, systematic in ((rows, True), (certain, True), (certain, False)):
        asked = options.settings.significance
        (values,) = final_estimates(data, end, asked, systematic=systematic).parameters
        told.append(
            [(values[n].value - x) / values[n].sd for n, x in zip(NAMES, true, strict=True)]
        )
    return np.array(told)


def main() -> None:
    """Print the counts."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--arms", type=int, default=20)
    options.add_argument("--seed", type=int, default=0)
    chosen, found = options.parse_args(), []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(chosen.seed, chosen.seed + chosen.arms):
            rng = np.random.default_rng(seed)
            kg = float(rng.uniform(0.3, 1.5))
            at = rng.uniform([-0.05, -0.05, 0.03], [0.05, 0.05, 0.12]).tolist()
            hidden = Path(folder) / f"hidden{seed}.yaml"
            hidden.write_text(
                yaml.safe_dump({"effects": [{"effect": "payload", "kg": kg, "at_m": at}]})
            )
            free, loaded = (
                cell(Path(folder), seed, SPREAD),
                cell(Path(folder), seed, SPREAD, hidden),
            )
            model = identified(recorded(free, MOTION, PERIODS))
            logs = [recorded(loaded, motion, PERIODS) for motion in (MOTION, OTHER_MOTION)]
            found.append([errors(log, model, [kg, *(kg * x for x in at)]) for log in logs])
    z = np.abs(found)  # arms, motions, kinds, values
    for kind, name in enumerate(("as reported", "reference taken as certain", "alone")):
        held = (z[:, :, kind] < QUANTILE_90).sum(axis=0)
        print(f"{name}: same motion {held[0]}, another {held[1]} of {len(z)} each: {NAMES}")


if __name__ == "__main__":
    main()
