"""Whether one model predicts a recording better than another one, beyond chance.

Run: .venv/bin/python scripts/benchmarks/paired_errors.py LOG FIRST/model.yaml SECOND/model.yaml

Prints both models' relative torque errors at the first one's cut-off, and their difference with its
standard error: the recording is cut into stretches, of which one is left out at a time, and two or
three neighbours, since errors last longer than a stretch; the largest of the three is told.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.effects.bound_effects import load_model
from ident.effects.simulated_model import with_loads
from ident.identification.validation import arm_of, predict
from ident.recordings.loading import Reading, read_for
from ident.regression.squared_errors import sums
from ident.workflows.validate import checked

Array = NDArray[np.float64]

NEIGHBOURS = 1, 2, 3


def squares(log: Path, path: Path, cutoff_hz: float) -> Array:
    """Squared residual and torque of each stretch [N^2 m^2], shape (stretches, 2)."""
    model = load_model(path)
    arm = arm_of(model).with_settings(cutoff_hz=cutoff_hz)
    (data,), _ = checked(with_loads(arm, model), [read_for(arm, log, Reading())])
    found = predict(model, arm, data)
    rows, beta = found.evidence.logs[0].reduction, found.betas[model.estimator]
    each = [sums(rows.R[b], rows.count[b], beta) for b in range(len(rows.count))]
    return np.array([[s.residual.sum(), s.torque.sum()] for s in each])


def main() -> None:
    """Compare two models on one recording."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("log", type=Path)
    parser.add_argument("models", type=Path, nargs=2)
    args = parser.parse_args()
    cutoff_hz = load_model(args.models[0]).filter.cutoff_hz
    first, second = (squares(args.log, path, cutoff_hz) for path in args.models)
    torque = first[:, 1]  # of the whole: the second model's effects may be taken off its own

    def errors(kept: NDArray[np.bool_]) -> Array:
        left = np.array([first[kept, 0].sum(), second[kept, 0].sum()])
        return 100 * np.sqrt(left / torque[kept].sum())

    count, spreads = len(torque), []
    for n in NEIGHBOURS:
        without = [errors(np.arange(count) // n != g) for g in range(-(-count // n))]
        apart = np.array([e[1] - e[0] for e in without])
        spreads.append(np.sqrt((len(apart) - 1) * np.mean((apart - apart.mean()) ** 2)))
    whole = errors(np.ones(count, dtype=bool))
    print(f"{whole[0]:.2f} and {whole[1]:.2f} % below {cutoff_hz:.3g} Hz")
    print(f"difference {whole[1] - whole[0]:.2f} ± {max(spreads):.2f} %")


if __name__ == "__main__":
    main()
