"""Investigations of arms in forms that the tool does not know: right, wrong, and how soon.

Run: .venv/bin/python scripts/benchmarks/investigations.py FOLDER [--each N] [--seed S]
     [--kind KIND].. [--choice best|random|repeat]
     .venv/bin/python scripts/benchmarks/investigations.py --table FOLDER..

Each arm is one of the blind benchmark's: links and friction drawn, every joint turns round in its
own way, effects of other forms than the catalogue's. Its motions are followed in closed loop by
that benchmark's code in the place of `wamctl excite`; all else is `wamctl investigate` as it is,
its programs run in this process. FOLDER/cases.jsonl gets a line for each arm.

Kinds: `pair` hides an effect whose rivals look like it, `small` one of a quarter to a half of the
floor in the first log, `foreign` one of the catalogue's, `outside` one that is not in it, and
`nothing`. With `--choice`, the next motion is not chosen: one drawn at random, or the first again.
"""

import argparse
import contextlib
import io
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from gap_cases import KNOWN, STRANGE, Case, Plant, draw, first_motion, plant, usual_of
from gap_effects import make
from gap_naming import levels, source_of
from gap_plants import Hidden

import ident.cli
import ident.workflows.plan
import wamctl.investigation.rounds
from ident.excitation.effect_motions import Sketch
from ident.gap.data.experiment import facts_of
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, nominal_fit
from ident.gap.search import rows_of
from ident.planning import choice
from wamctl.arm.errors import UserError
from wamctl.arm.recorder import write_recording
from wamctl.arm.recording import Recording
from wamctl.arm.trajectory import read_trajectory, write_trajectory
from wamctl.experiment.preflight import load_arm
from wamctl.investigation.budget import Budget
from wamctl.investigation.investigate import investigate
from wamctl.investigation.programs import STOPPED, ProgramError
from wamctl.investigation.rounds import Site
from wamctl.investigation.state import Request

PAIRED = ("torque_delay", "rotor_inertia", "coupled_inertia", "joint_elasticity", "torque_gain")
LASTING = [f for f in KNOWN if f != "contact"]
KINDS: dict[str, tuple[list[str], float]] = {
    "pair": ([*PAIRED, "encoder_offset"], 1.0),
    "small": (LASTING, 0.3),
    "foreign": (LASTING, 0.5),
    "outside": (list(STRANGE), 1.0),
    "nothing": ([], 1.0),
}
"""Families of each kind, and the scale of their usual size."""
SMALL = (0.25, 0.5)
"""Level of a small effect: the visible part of the residual over that of the arm without it."""


@dataclass(frozen=True)
class Arm:
    """One arm, and what it hides."""

    kind: str
    seed: int
    plant: Plant
    case: Case | None
    hidden: Hidden
    level: float

    @property
    def answer(self) -> str:
        """The verdict that is right."""
        if self.case is None:
            return "no_gap"
        return "unknown" if self.case.answer == "unknown" else "named"


def drawn(kind: str, seed: int) -> Arm:
    """The arm of a seed."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    arm, excitation = plant(rng, seed), first_motion()
    families, scale = KINDS[kind]
    if not families:
        return Arm(kind, seed, arm, None, Hidden(), 0.0)
    free = arm.recorded(Hidden(), excitation)
    units, seen = usual_of(arm, free, excitation)
    case = draw(rng, units, scale, families)
    matrix = np.array(arm.file.transmission.motor_from_joint)
    form, wanted = int(rng.integers(2**31)), float(rng.uniform(*SMALL))
    bare = nominal(free)

    def made(size: float) -> tuple[Hidden, float]:
        hidden = make(case.family, case.joints, size, np.random.default_rng(form), matrix, seen)
        level = levels(nominal(arm.recorded(hidden, excitation)), bare)
        return hidden, float(level[list(case.felt)].max())

    hidden, level = made(case.size)
    for _ in range(4 if kind == "small" else 0):
        if SMALL[0] <= level <= SMALL[1]:
            break
        case = replace(case, size=case.size * float(np.clip(wanted / max(level, 0.05), 0.1, 3.0)))
        hidden, level = made(case.size)
    return Arm(kind, seed, arm, case, hidden, level)


def nominal(log: Recording) -> CurrentFit:
    """The model without effects."""
    source = source_of(log, None)
    return nominal_fit(rows_of(source, Options()), facts_of(source))


def in_this_process(arm: Arm) -> Any:
    """What calls the programs of an investigation; the arm's motions are those of the benchmark."""

    def call(module: str, arguments: Sequence[str], lock: int | None = None) -> None:
        words = list(arguments)
        if module == "wamctl.cli":
            path, out = (words[words.index(o) + 1] for o in ("--trajectory", "--out"))
            try:
                write_recording(out, arm.plant.recorded(arm.hidden, read_trajectory(path)))
            except ValueError as error:
                raise ProgramError("wamctl excite", STOPPED, str(error)) from error
            return
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            try:
                ident.cli.app(words, standalone_mode=False)
            except UserError as error:
                raise ProgramError(f"ident {words[0]}", error.exit_code, str(error)) from error

    return call


def investigated(arm: Arm, folder: Path) -> dict[str, Any]:
    """Investigate an arm to its end."""
    out = folder / f"{arm.kind}-{arm.seed}"
    out.mkdir(parents=True, exist_ok=True)
    first = out / "first.yaml"
    write_trajectory(first, first_motion())
    path, known = load_arm(Path("wam7.yaml"))
    request = Request(str(path), "sim", True, None, arm.seed, str(first))
    wamctl.investigation.rounds.call = in_this_process(arm)
    began = time.process_time()
    site = Site(out, known, (), lambda _: None)
    found = investigate(site, request, Budget(wall_s=1e9), (out / "state.json").exists()).content
    return told(arm, found) | {"cpu_s": time.process_time() - began}


def told(arm: Arm, found: dict[str, Any]) -> dict[str, Any]:
    """What an investigation said, and whether it is right."""
    names = [(e["name"], e["joints"]) for e in found["effects"] if e["name"] != "measured_effect"]
    bristles = {j + 1 for j in arm.plant.bristles}
    told = [(n, j) for n, j in names if not (n == "presliding" and set(j) <= bristles)]
    verdict, case = found["verdict"], arm.case
    if verdict == "named" and not told:
        verdict = "no_gap"
    right = verdict == arm.answer
    truth = {"no_gap": "none", "unknown": "unknown"}.get(arm.answer, "")
    if case is not None and arm.answer == "named":
        hit = [n == case.answer and case.at({i - 1 for i in j}) for n, j in told]
        right = right and all(hit)
        own = [j + 1 for j in case.joints]
        joints = next((j for (_, j), h in zip(told, hit, strict=True) if h), own)
        truth = f"{case.answer}:{'-'.join(map(str, joints))}"
    odds = found["rounds"][-1]["odds"]
    wrong = verdict == "named" and not right
    return {
        "kind": arm.kind,
        "seed": arm.seed,
        "case": None if case is None else asdict(case),
        "level": arm.level,
        "verdict": found["verdict"],
        "confirmed": found["confirmed"],
        "effects": names,
        "right": right,
        "wrong": wrong and found["confirmed"],
        "first": [found["rounds"][0]["verdict"], found["rounds"][0]["answer"]],
        "motions": len(found["rounds"]) - 1,
        "motion_s": found["motion_s"],
        "odds": odds,
        "truth": truth,
        "leader": max(odds, key=lambda k: odds[k]),
        "brier": sum((p - (k == truth)) ** 2 for k, p in odds.items()) + (truth not in odds),
        "closed": [r["closed"].get("none") for r in found["rounds"]],
        "why": found["why"],
    }


@contextlib.contextmanager
def next_motion(kind: str) -> Iterator[None]:
    """Motions that are not chosen but drawn, or the first one again."""
    choose = ident.workflows.plan.motions

    def other(place: Any, found: Any, joints: Any, ran: Any) -> list[choice.Motion]:
        if kind == "random":
            every = choose(place, found, joints, ran)
            return [m for m in every if m.name.startswith("scattered")][:1]
        series = first_motion().series
        coefficients = np.vstack([series.a.T, series.b.T, series.q0])
        again = Sketch(2 * np.pi / series.fundamental_rad_s, coefficients, 2)
        return [choice._judged(place, found, f"again:{len(ran)}", again)]  # noqa: SLF001

    ident.workflows.plan.motions = choose if kind == "best" else other
    yield
    ident.workflows.plan.motions = choose


def table(folders: Sequence[Path]) -> None:
    """Sum up what has been run."""
    texts = [(f / "cases.jsonl").read_text("utf-8") for f in folders]
    lines = [json.loads(line) for text in texts for line in text.splitlines()]
    for kind in KINDS:
        own = [x for x in lines if x["kind"] == kind]
        if own:
            print(f"{kind}: {summed(own)}")
    print(f"all: {summed(lines)}")
    for low, high in ((0.0, 0.2), (0.2, 0.5), (0.5, 0.8), (0.8, 0.95), (0.95, 1.01)):
        leading = [x for x in lines if low <= x["odds"][x["leader"]] < high]
        right = sum(x["leader"] == x["truth"] for x in leading)
        if leading:
            mean = np.mean([x["odds"][x["leader"]] for x in leading])
            print(f"odds {low:.2f} to {high:.2f}: {right} of {len(leading)}, told {mean:.3f}")
    for x in sorted(lines, key=lambda x: (x["kind"], x["seed"])):
        case = x["case"]
        what = f"{case['family']}:{case['joints'][0] + 1}, {x['level']:.2g}" if case else "nothing"
        mark = "right" if x["right"] else "WRONG" if x["wrong"] else "open"
        said = " ".join(f"{n}:{j}" for n, j in x["effects"])
        sure = "confirmed" if x["confirmed"] else "not confirmed"
        print(
            f"  {x['kind']} {x['seed']} {what}: {mark}; first {x['first']}, then {x['verdict']} "
            f"{said} ({sure}) after {x['motions']}, {x['motion_s']:.0f} s; {x['why']}"
        )


def summed(lines: Sequence[dict[str, Any]]) -> str:
    """Counts and medians of some cases."""
    sure = sum(x["right"] and x["confirmed"] for x in lines)
    return (
        f"{sum(x['right'] for x in lines)} of {len(lines)} right ({sure} confirmed), "
        f"{sum(x['wrong'] for x in lines)} wrong and confirmed; "
        f"{np.median([x['motions'] for x in lines]):.0f} further motions, "
        f"{np.median([x['motion_s'] for x in lines]):.0f} s of motion, "
        f"{np.median([x['cpu_s'] for x in lines]):.0f} s of processor time (medians); "
        f"Brier score {np.mean([x['brier'] for x in lines]):.3f}"
    )


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="+")
    parser.add_argument("--each", type=int, default=1)
    parser.add_argument("--seed", type=int, default=80000)
    parser.add_argument("--kind", action="append", choices=list(KINDS))
    parser.add_argument("--choice", choices=("best", "random", "repeat"), default="best")
    parser.add_argument("--table", action="store_true")
    wanted = parser.parse_args()
    if wanted.table:
        table(wanted.folder)
        return
    (folder,) = wanted.folder
    folder.mkdir(parents=True, exist_ok=True)
    lines = folder / "cases.jsonl"
    text = lines.read_text("utf-8") if lines.exists() else ""
    done = {(x["kind"], x["seed"]) for x in map(json.loads, text.splitlines())}
    for seed in range(wanted.seed, wanted.seed + wanted.each):
        for kind in wanted.kind or KINDS:
            if (kind, seed) in done:
                continue
            try:
                with next_motion(wanted.choice):
                    line = investigated(drawn(kind, seed), folder)
            except (UserError, ValueError) as error:
                print(f"{kind} {seed} was not run: {error}", flush=True)
                continue
            with lines.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
            print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
