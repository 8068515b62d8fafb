"""Models of `ident gap` with named effects: their torque on another motion, and their MJCF.

Run: .venv/bin/python scripts/benchmarks/exported_arms.py [--arms N] [--seed S] [--null-runs N]
         [--out FILE]
     .venv/bin/python scripts/benchmarks/exported_arms.py --table FILE..

Each arm is a simulated WAM (`own_plant.py`) with links and friction drawn anew and one hidden
effect of `sim_bus`. It is searched on two periods of the shipped motion, and judged on one of
another motion:

- torque: rms error of the model, of `ident run`'s (without the effect), and of the arm's true links
  and friction on the same motion without the effect, which is the noise floor, all at the cut-off
  of the fit; of effects that make a joint stick more, the floor is also told with the true effect,
  since no model tells the torque of a joint that sticks;
- replay: rms joint error against the recording of the exported MJCF in MuJoCo, and of our own
  simulation, at the joint where MuJoCo is worst beside it; their ratio there, and rms over the
  joints; and the same two of our own simulation beside itself along a wanted motion a microradian
  off: encoders, drives and friction make of that another error of some steps;
- the effect's values: error in standard deviations.

With `--null-runs 0` the thresholds are those of noise alone, and an arm takes a third of the time.
`payload` is searched beside a model of the arm before. Seeds below 100 are for development.
"""

import argparse
import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from own_plant import COULOMB, MOTION, OTHER_MOTION, cell, recorded

from ident.effects.bound_effects import bound
from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.replay import replay, rms_of
from ident.gap.data.experiment import experiment
from ident.gap.options import Options
from ident.identification.identify import identify, model_of
from ident.identification.standard_errors import QUANTILE_90
from ident.model.identified_model import Model, NoEffects
from ident.model.records import EffectRecord
from ident.workflows.gap import Gap, gap_of
from ident.workflows.gap_outcome import counted
from ident.workflows.model_errors import errors_on
from sim_bus.assembly import load_simulation
from sim_bus.plant.truth import Truth
from wamctl.arm.recording import Recording

Array = NDArray[np.floating]
Draw = Callable[[np.random.Generator], tuple[dict[str, Any], dict[str, float]]]
Form = tuple[str, dict[str, float], dict[str, float]]

PERIODS = 2
SPREAD = 0.4
NUDGE_RAD = 1e-6


def _joint(rng: np.random.Generator, first: int = 1) -> int:
    return int(rng.integers(first, 7))


def _spring(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    j = _joint(rng, 2)
    k = float(COULOMB[j - 1] * rng.uniform(2.0, 4.0))
    return {"joints": [j], "nm_rad": k, "rest_rad": 0.3}, {"stiffness": k}


def _stribeck(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    j, form = _joint(rng), str(rng.choice(["gaussian", "exponential"]))
    extra, speed = float(COULOMB[j - 1] * rng.uniform(0.6, 1.0)), float(rng.uniform(0.1, 0.3))
    hidden = {"joints": [j], "form": form, "extra_nm": extra, "speed_rad_s": speed}
    return hidden, {"extra_friction": extra}


def _rotor(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    j = _joint(rng, 3)
    size = float((0, 0, 0.1, 0.08, 0.02, 0.02, 0.006)[j - 1] * rng.uniform(0.7, 1.5))
    return {"joints": [j], "kg_m2": size}, {"inertia": size}


def _offset(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    j = _joint(rng)
    size = float(COULOMB[j - 1] * rng.uniform(0.5, 1.0) * rng.choice([-1.0, 1.0]))
    return {"joints": [j], "nm": size}, {"offset": size}


def _payload(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    kg = float(rng.uniform(0.3, 1.0))
    return {"kg": kg, "at_m": [0.0, 0.0, 0.08]}, {"mass": kg}


def _gain(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    factor = float(rng.uniform(0.88, 0.95))
    return {"joints": [int(rng.choice([2, 4]))], "factor": factor}, {}


def _zero(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    size = float(rng.uniform(0.02, 0.04) * rng.choice([-1.0, 1.0]))
    return {"joints": [int(rng.choice([2, 4]))], "rad": size}, {"offset": size}


def _drag(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    j = _joint(rng)
    return {
        "joints": [j],
        "quadratic_nm_s2_rad2": float(COULOMB[j - 1] * rng.uniform(0.3, 0.6)),
    }, {}


def _one_way(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    j = _joint(rng)
    size = float(0.5 * COULOMB[j - 1] * rng.uniform(0.5, 1.0))
    return {"joints": [j], "nm_s_rad": size}, {"half_difference": size}


def _load(rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, float]]:
    return {"joints": [2], "share": float(rng.uniform(0.06, 0.1))}, {}


HIDDEN: dict[str, Draw] = {
    "joint_spring": _spring,
    "stribeck": _stribeck,
    "rotor_inertia": _rotor,
    "torque_offset": _offset,
    "payload": _payload,
    "torque_gain": _gain,
    "encoder_offset": _zero,
    "nonlinear_viscous": _drag,
    "asymmetric_viscous": _one_way,
    "load_dependent_friction": _load,
}


def _as_stribeck(hidden: dict[str, Any]) -> Form:
    exponent = {"exponential": 1.0, "gaussian": 2.0}[hidden["form"]]
    shape = {"speed": hidden["speed_rad_s"], "exponent": exponent, "slow_decay": 0.0}
    return "", {"extra_friction": hidden["extra_nm"]}, shape


def _as_load(hidden: dict[str, Any]) -> Form:
    return "motor torque", {"coefficient": hidden["share"]}, {"about": hidden["share"]}


STICKING: dict[str, Callable[[dict[str, Any]], Form]] = {
    "stribeck": _as_stribeck,
    "load_dependent_friction": _as_load,
}


def judged(seed: int, folder: Path, null_runs: int = 4) -> dict[str, Any]:
    """One arm: what was hidden, what was named, and how well model and export predict."""
    family = list(HIDDEN)[seed % len(HIDDEN)]
    hidden, values = HIDDEN[family](np.random.default_rng(seed))
    effects = folder / f"hidden{seed}.yaml"
    effects.write_text(yaml.safe_dump({"effects": [{"effect": family} | hidden]}))
    arm, free = cell(folder, seed, SPREAD, effects), cell(folder, seed, SPREAD)
    truth = load_simulation(free.path, seed).truth
    log = recorded(arm, MOTION, PERIODS)
    other, other_free = (recorded(x, OTHER_MOTION, 1) for x in (arm, free))
    before = identified(recorded(free, MOTION, PERIODS)) if family == "payload" else None
    found = searched(log, before, null_runs)
    plain = before or identified(log)
    true = replace(true_model(plain, truth), effects=NoEffects())
    errors = [
        errors_on(model, counted(experiment([there], ["other"])))[0]
        for model, there in ((found.model, other), (plain, other), (true, other_free))
    ]
    followed, again = (
        rms_of([replay(to_mjcf(found.model), found.model, log, "other")])
        for log in (other, beside(other))
    )
    ratio, itself = (np.divide(x, followed["own"]) for x in (followed["mujoco"], again["own"]))
    joint = int(np.argmax(ratio))
    return {
        "seed": seed,
        "hidden": family,
        "joints": hidden.get("joints", []),
        "verdict": found.content["verdict"],
        "named": [[e["name"], e["joints"]] for e in found.content["effects"]],
        "errors_percent": [e["relative_error_percent"] for e in errors],
        "floor_with_effect": floor_with_effect(true, family, hidden, other),
        "rms_by_joint": [e["rms_by_joint"] for e in errors],
        "replay_rad": [followed[name][joint] for name in ("mujoco", "own")],
        "replay_joint": joint + 1,
        "replay_ratios": [ratio.tolist(), itself.tolist()],
        "left_out": left_out_of_mjcf(found.model),
        "deviations": deviations(found, family, values),
    }


def floor_with_effect(
    true: Model, family: str, hidden: dict[str, Any], other: Recording
) -> float | None:
    """Error [%] of the true arm with the true effect, of effects that make a joint stick more."""
    if family not in STICKING:
        return None
    variant, parameters, settings = STICKING[family](hidden)
    joints = tuple(hidden["joints"])
    record = EffectRecord(
        name=family,
        joints=joints,
        rows=joints,
        variant=variant,
        parameters=parameters,
        settings=settings,
    )
    there = counted(experiment([other], ["other"]))
    return errors_on(replace(true, effects=bound((record,))), there)[0]["relative_error_percent"]


def beside(log: Recording) -> Recording:
    """The same with a wanted motion that is a little off."""
    wanted = log.reference
    return (
        log if wanted is None else replace(log, reference=replace(wanted, q=wanted.q + NUDGE_RAD))
    )


def identified(log: Recording) -> Model:
    """What `ident run` makes of a recording."""
    source = experiment([log], ["log"])
    return model_of(identify(source.datasets, source.arm))


def searched(log: Recording, before: Model | None, null_runs: int) -> Gap:
    """What `ident gap` makes of it."""
    source = replace(experiment([log], ["log"]), reference_model=before)
    return gap_of(source, Options(null_runs=null_runs), lambda _: None)


def true_model(found: Model, truth: Truth) -> Model:
    """The arm's own links and friction in the form of an identified model."""
    own, links = {"fv": truth.viscous, "fc": truth.coulomb}, iter(truth.delta)
    delta = [
        next(links) if p.kind == "inertial" else own[p.kind][p.index - 1] if p.kind in own else 0.0
        for p in found.parameters
    ]
    return replace(found, delta=np.array(delta), base_parameters=(), effects=NoEffects())


def deviations(found: Gap, family: str, values: dict[str, float]) -> dict[str, list[float]]:
    """Error and standard deviation of each known value of the effect, where it was named."""
    for effect in found.content["effects"]:
        if effect["name"] == family:
            said = effect["parameters"]
            return {
                name: [abs(said[name]["value"]) - abs(value), said[name]["sd"]]
                for name, value in values.items()
                if name in said
            }
    return {}


def ratios(by_joint: list[float]) -> tuple[float, float]:
    """The largest, and the rms over the joints."""
    return max(by_joint), float(np.sqrt(np.mean(np.square(by_joint))))


def line(arm: dict[str, Any]) -> str:
    """A row of the table."""
    model, plain, floor = arm["errors_percent"]
    whole = arm["floor_with_effect"]
    with_effect = "" if whole is None else f", {model / whole:.2f} with it"
    mujoco, own = arm["replay_rad"]
    worst, over_joints = zip(*map(ratios, arm["replay_ratios"]), strict=True)
    named = ", ".join(f"{name} {joints}" for name, joints in arm["named"]) or "–"
    z = ", ".join(f"{name} {e / sd:+.1f}" for name, (e, sd) in arm["deviations"].items())
    return (
        f"| {arm['seed']} | {arm['hidden']} {arm['joints']} | {named} | {plain:.2f} | {model:.3f}"
        f" | {floor:.3f} | {model / floor:.2f}{with_effect} | {1e3 * mujoco:.2f} | {1e3 * own:.2f}"
        f" | {worst[0]:.2f}, {over_joints[0]:.2f} | {worst[1]:.2f}, {over_joints[1]:.2f} | {z} |"
    )


def summary(arms: list[dict[str, Any]]) -> str:
    """How many keep the bounds, and how many intervals hold."""
    torque = sum(a["errors_percent"][0] <= 1.1 * a["errors_percent"][2] for a in arms)
    best = [max(a["errors_percent"][2], a["floor_with_effect"] or 0.0) for a in arms]
    whole = sum(a["errors_percent"][0] <= 1.1 * x for a, x in zip(arms, best, strict=True))
    within = [
        [sum(ratios(a["replay_ratios"][i])[k] <= 1.2 for a in arms) for k in (0, 1)] for i in (0, 1)
    ]
    held = [abs(e) < QUANTILE_90 * sd for a in arms for e, sd in a["deviations"].values()]
    replays = "{} at each joint, {} over the joints"
    return (
        f"{len(arms)} arms: torque within 1.1 times the floor {torque}, {whole} with"
        f" the true effect in it; replay within 1.2 times our"
        f" own {replays.format(*within[0])} (our own beside itself {replays.format(*within[1])});"
        f" 90 % intervals of effects hold {sum(held)} of {len(held)}"
    )


def main() -> None:
    """Print a row for each arm, then the counts."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--arms", type=int, default=20)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--null-runs", type=int, default=4)
    options.add_argument("--out", type=Path)
    options.add_argument("--table", type=Path, nargs="+")
    chosen = options.parse_args()
    if chosen.table:
        arms = [json.loads(row) for path in chosen.table for row in path.read_text().splitlines()]
        print("\n".join([*map(line, arms), summary(arms)]))
        return
    arms = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(chosen.seed, chosen.seed + chosen.arms):
            arms.append(judged(seed, Path(folder), chosen.null_runs))
            print(line(arms[-1]), flush=True)
            if chosen.out:
                with chosen.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(arms[-1]) + "\n")
    print(summary(arms))


if __name__ == "__main__":
    main()
