"""How often the 90 % intervals of an effect's values hold, as `ident gap` gives them.

Run: .venv/bin/python scripts/benchmarks/effect_intervals.py own|foreign --effect NAME [--arms N]
         [--seed S] [--out FILE]

`own`: simulated WAMs (`own_plant.py`) with links and friction drawn anew and one hidden effect of
`sim_bus`, drawn as in `exported_arms.py`; a payload lies off the axis. `foreign`: arms of the blind
benchmark (`gap_cases.py`), with torque noise, joints that turn round in eight ways, and effects in
forms that the catalogue does not have, 0.5 to 1.3 times their usual size there.

The effect is not searched but fitted where it is, its form and parameters chosen as the search
chooses them: beside links that are fitted with it, on two periods of the shipped motion, a payload
beside a model that was identified without it on that motion, on two periods of it and of another
one. `--out` appends each value's error and standard deviation to a file, a line of JSON an arm.
Seeds below 4000 are for development.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from exported_arms import HIDDEN, SPREAD, identified
from gap_cases import KNOWN, RARE, draw, first_motion, plant, truth_of, usual_of
from gap_effects import make
from gap_plants import Hidden
from numpy.typing import NDArray
from own_plant import MOTION, OTHER_MOTION, cell, recorded

from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import experiment, facts_of
from ident.gap.options import Options
from ident.gap.regression.current_model import extend, nominal_fit
from ident.gap.search import rows_of
from ident.gap.selection.candidates import examine
from ident.gap.selection.estimates import final_estimates
from ident.gap.selection.rivals import accept
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.identification.standard_errors import QUANTILE_90
from ident.model.identified_model import Model
from wamctl.arm.recording import Recording

PERIODS = 2
VALUED = (
    *("payload", "joint_spring", "stribeck", "rotor_inertia", "torque_offset", "encoder_offset"),
    "asymmetric_viscous",
)
MOMENTS = tuple(f"first_moment_{axis}" for axis in "xyz")
Errors = dict[str, list[float]]


@dataclass(frozen=True)
class Carrier:
    """An arm and its hidden effect.

    Attributes:
        joints: where it is, from 0; empty for the whole arm.
        values: as `ident gap` names them.
        record: the log of a motion, with the effect or without.
    """

    joints: tuple[int, ...]
    values: dict[str, float]
    record: Callable[[str, bool], Recording]


def own(family: str, seed: int, folder: Path) -> Carrier:
    """A simulated WAM."""
    hidden, values = drawn(family, seed)
    file = folder / f"hidden{seed}.yaml"
    file.write_text(yaml.safe_dump({"effects": [{"effect": family} | hidden]}))

    def record(motion: str, with_effect: bool) -> Recording:
        return recorded(cell(folder, seed, SPREAD, file if with_effect else None), motion, PERIODS)

    return Carrier(tuple(j - 1 for j in hidden.get("joints", [])), values, record)


def foreign(family: str, seed: int, _: Path) -> Carrier:
    """An arm of the blind benchmark."""
    rng = np.random.default_rng(seed)
    arm = plant(rng, seed)
    units, seen = usual_of(arm, arm.recorded(Hidden(), first_motion()), first_motion())
    case = draw(rng, units, 1.0, [family])
    usual, unit = (KNOWN | RARE)[family]
    size = usual * float(units[unit][case.joints[0]] * np.exp(rng.uniform(-0.7, 0.3)))
    case = replace(case, size=size)
    motors = np.array(arm.file.transmission.motor_from_joint)
    hidden = make(family, case.joints, size, rng, motors, seen)
    values = truth_of(case, hidden)
    if family == "payload":
        values |= dict(zip(MOMENTS, map(float, hidden.payload[6:9]), strict=True))

    def record(motion: str, with_effect: bool) -> Recording:
        return arm.recorded(hidden if with_effect else Hidden(), first_motion(motion))

    return Carrier(() if family == "payload" else case.joints, values, record)


def drawn(family: str, seed: int) -> tuple[dict[str, Any], dict[str, float]]:
    """A hidden effect, and its values as `ident gap` names them."""
    rng = np.random.default_rng(seed)
    if family != "payload":
        hidden, values = HIDDEN[family](rng)
        if family == "joint_spring":
            values["torque_at_zero"] = -hidden["nm_rad"] * hidden["rest_rad"]
        return hidden, values
    kg = float(rng.uniform(0.3, 1.5))
    at = rng.uniform([-0.05, -0.05, 0.03], [0.05, 0.05, 0.12]).tolist()
    moments = (kg * x for x in at)
    return {"kg": kg, "at_m": at}, {"mass": kg} | dict(zip(MOMENTS, moments, strict=True))


def errors(
    log: Recording, model: Model | None, family: str, joints: Sequence[int], true: dict[str, float]
) -> Errors:
    """Error and standard deviation of each value; but for moments, of its size."""
    source, options = replace(experiment([log], ["log"]), reference_model=model), Options()
    rows, facts, asked = rows_of(source, options), facts_of(source), options.settings
    start = nominal_fit(rows, facts)
    state = SelectionState(rows, start, least_threshold(asked.thresholds, model is not None), None)
    candidates = [
        h for h in catalogue()[family].candidates(facts) if not joints or h.joints == tuple(joints)
    ]
    design, scores = examine(rows, start, candidates, asked.scoring)
    if not scores:
        raise ValueError(f"no {family} explains anything at its place")
    found = accept(state, design, scores[0], (), asked)
    end = extend(rows, start, [found.candidate])
    (values,) = final_estimates(rows, end, asked.significance, [found], systematic=True).parameters
    return {name: [error(name, values[name].value, x), values[name].sd] for name, x in true.items()}


def error(name: str, value: float, true: float) -> float:
    """Error of a value; of sizes without sign where only a moment's sign is known."""
    return value - true if name in MOMENTS else abs(value) - abs(true)


def fitted(family: str, arm: Carrier) -> dict[str, Errors]:
    """Errors of the values of one arm, by motion."""
    model, motions = None, {"same": MOTION}
    if catalogue()[family].needs_reference_model:
        model, motions = identified(arm.record(MOTION, False)), motions | {"other": OTHER_MOTION}
    return {
        name: errors(arm.record(motion, True), model, family, arm.joints, arm.values)
        for name, motion in motions.items()
    }


def told(arms: list[dict[str, Errors]]) -> str:
    """How many intervals hold of each value, and mean and rms of their errors in deviations."""
    lines, inside = [], []
    for motion, values in arms[0].items():
        for name in values:
            each: NDArray[np.floating] = np.array([arm[motion][name] for arm in arms])
            z = each[:, 0] / each[:, 1]
            inside.append(np.abs(z) < QUANTILE_90)
            lines.append(
                f"{motion} motion, {name}: {inside[-1].sum()} of {len(z)}; errors in deviations:"
                f" mean {z.mean():+.2f}, rms {np.sqrt(np.mean(z**2)):.2f}, largest"
                f" {np.abs(z).max():.1f}"
            )
    return "\n".join([*lines, f"all: {np.mean(inside):.1%}"])


def main() -> None:
    """Print the counts."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("kind", choices=("own", "foreign"))
    options.add_argument("--effect", choices=VALUED, required=True)
    options.add_argument("--arms", type=int, default=20)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--out", type=Path)
    chosen, arms = options.parse_args(), []
    carrier = {"own": own, "foreign": foreign}[chosen.kind]
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(chosen.seed, chosen.seed + chosen.arms):
            try:
                arms.append(fitted(chosen.effect, carrier(chosen.effect, seed, Path(folder))))
            except ValueError as error:
                print(f"{seed}: {error}")  # it did not follow, say
                continue
            if chosen.out:
                with chosen.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"seed": seed} | arms[-1]) + "\n")
    print(told(arms))


if __name__ == "__main__":
    main()
