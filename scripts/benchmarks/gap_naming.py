"""Blind benchmark of `ident gap`: arms and effects in forms that the tool does not know.

Run: .venv/bin/python scripts/benchmarks/gap_naming.py [--runs N] [--seed S] [--hidden 0|1|2]
     [--trusted] [--out FILE]
     .venv/bin/python scripts/benchmarks/gap_naming.py --table FILE..

With `--trusted`, the arm is identified without the effect first, as `ident run` does, and what has
changed since is asked.

Each run perturbs the arm's links and friction, draws for each joint how it turns round (stick,
Dahl, LuGre, slip, four sign shapes), hides effects, records two periods in closed loop, and
searches. `--out` appends a line of JSON for each run, from which `--table` makes the tables.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from gap_cases import CHANGES, KNOWN, MOTION, STRANGE, Run, run, truth_of
from gap_tables import Told, append, print_tables, read

from ident.gap.data.blocks import HELD_OUT, blocks_of
from ident.gap.data.experiment import Experiment, base_columns, experiment, facts_of
from ident.gap.data.noise_regions import Region
from ident.gap.data.reference_model import reference_torque
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, nominal_fit
from ident.gap.regression.rows import WindowedRows, windowed_rows
from ident.gap.regression.weighted_fit import Fit, predicted_rms
from ident.gap.results.outcome import SearchResult
from ident.gap.results.verdict import Kind
from ident.gap.search import search
from ident.gap.selection.estimates import final_estimates
from ident.identification.identify import identify, model_of
from ident.model.identified_model import Model
from wamctl.arm.recording import Recording


def squares(rows: WindowedRows, current: CurrentFit) -> np.ndarray:
    """Mean squared residual of the held-out fold where the joints slide, shape (7,)."""
    there = current.design(rows).equations.of([HELD_OUT])
    return _sliding(predicted_rms(there, current.fit), there.counts[:, 0])


def _sliding(sigma: np.ndarray, counts: np.ndarray) -> np.ndarray:
    kept = np.arange(len(Region)) != Region.REVERSAL
    total = (sigma**2 * counts)[:, kept].sum(axis=1)
    return total / np.maximum(counts[:, kept].sum(axis=1), 1)


def fitted(model: Fit) -> np.ndarray:
    """Mean squared residual of a fit's own data where the joints slide, shape (7,)."""
    return _sliding(model.sigma, model.counts)


def nominal_of(log: Recording, like: SearchResult) -> tuple[WindowedRows, CurrentFit]:
    """The nominal model of another recording of the same arm."""
    source = source_of(log, like.source.reference_model)
    windows = like.rows.windows
    facts = facts_of(source)
    blocks = blocks_of(source.datasets, windows)
    rows = windowed_rows(blocks, facts, base_columns(source), reference_torque(source))
    return rows, nominal_fit(rows, facts)


def source_of(log: Recording, trusted: Model | None) -> Experiment:
    """A recording, beside a model that is trusted."""
    return replace(experiment([log], ["log"]), reference_model=trusted)


def identified(log: Recording) -> Model:
    """What `ident run` makes of a recording."""
    source = experiment([log], ["log"])
    return model_of(identify(source.datasets, source.arm))


def levels(present: CurrentFit, free: CurrentFit) -> np.ndarray:
    """Visible part of the residual beside that of the effect-free arm, shape (7,).

    An effect's level is the largest at the joints that feel it: at others it is chance.
    """
    return np.sqrt(np.maximum(fitted(present.fit) / fitted(free.fit) - 1.0, 0.0))


def told(recorded: Run, found: SearchResult, seed: int, seconds: float) -> Told:
    """What is written of a run."""
    verdict = found.verdict
    free_rows, free = nominal_of(recorded.free, found)
    level = levels(found.start, free)
    each = [
        levels(nominal_of(log, found)[1], free)[list(case.felt)].max()
        for case, log in zip(recorded.cases, recorded.alone, strict=True)
    ]
    before, after = (squares(found.rows, p) for p in (found.start, found.end))
    seat = int(level.argmax())
    gap = before[seat] - squares(free_rows, free)[seat]
    named = [(f.candidate.effect, f.candidate.joints) for f in verdict.effects]
    named += [("contact", b.joints) for b in verdict.transients]
    settings = found.options.settings.significance
    end = found.rows, found.end, settings, verdict.effects
    values = final_estimates(*end, systematic=True).parameters
    right, wrong = judged(recorded, verdict.kind, named)
    return Told(
        seed,
        [c.family for c in recorded.cases],
        [[j + 1 for j in c.joints] for c in recorded.cases],
        [c.size for c in recorded.cases],
        any(c.answer == "unknown" for c in recorded.cases),
        float(min(each, default=level.max())),
        str(verdict.kind),
        [name for name, _ in named],
        [[j + 1 for j in joints] for _, joints in named],
        sorted({r.candidate.effect for f in verdict.effects for r in f.rivals}),
        [f"joint {n.structure.joint + 1} by {n.structure.group}" for n in verdict.unexplained],
        [{name: [v.value, v.sd] for name, v in effect.items()} for effect in values],
        [truth_of(c, h) for c, h in zip(recorded.cases, recorded.hidden, strict=True)],
        float((before[seat] - after[seat]) / gap) if gap > 0.0 else 0.0,
        right,
        wrong,
        seconds,
    )


def judged(
    recorded: Run, kind: Kind, named: list[tuple[str, tuple[int, ...]]]
) -> tuple[bool, bool]:
    """Whether the answer is right, and whether it is wrong and confident.

    A joint that turns round on bristles has presliding: naming that too is no error.
    """
    named = [
        (name, joints)
        for name, joints in named
        if not (name == "presliding" and set(joints) <= recorded.bristles)
    ]
    sure = kind == Kind.NAMED
    if not recorded.cases:
        return kind != Kind.UNKNOWN and not named, sure and bool(named)
    known = [c for c in recorded.cases if c.answer != "unknown"]
    answers = {c.answer for c in known}
    others = [name for name, _ in named if name not in answers]
    if len(known) < len(recorded.cases):
        return kind == Kind.UNKNOWN, sure and bool(others)
    hit = [any(name == c.answer and c.at(set(j)) for name, j in named) for c in known]
    good = kind in (Kind.NAMED, Kind.AMBIGUOUS) and all(hit) and not (sure and others)
    return good, sure and bool(named) and (bool(others) or not any(hit))


def main() -> None:
    """Print a line for each run, then the tables."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--runs", type=int, default=10)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--hidden", type=int, choices=(0, 1, 2), default=1)
    options.add_argument("--family", action="append", help="hide one of these only")
    options.add_argument("--trusted", action="store_true", help="ask what has changed since")
    options.add_argument("--null-runs", type=int, default=Options().null_runs)
    options.add_argument("--scale", type=float, default=1.0)
    options.add_argument("--motion", default=MOTION, help="the trajectory's file")
    options.add_argument("--out", type=Path)
    options.add_argument("--table", type=Path, nargs="+")
    chosen = options.parse_args()
    if chosen.table:
        print_tables(read(chosen.table))
        return
    families = chosen.family or [*KNOWN, *(STRANGE if chosen.hidden < 2 else ())]
    if chosen.trusted and not chosen.family:
        families = list(CHANGES)
    runs = []
    for seed in range(chosen.seed, chosen.seed + chosen.runs):
        try:
            recorded = run(seed, chosen.hidden, chosen.scale, families, chosen.motion)
        except ValueError as error:
            print(f"{seed:5d} not recorded: {error}")
            continue
        began = time.perf_counter()
        model = identified(recorded.free) if chosen.trusted else None
        found = search(
            source_of(recorded.log, model), Options(null_runs=chosen.null_runs), lambda _: None
        )
        runs.append(told(recorded, found, seed, time.perf_counter() - began))
        print(runs[-1].line, flush=True)
        if chosen.out:
            append(chosen.out, runs[-1])
    print_tables(runs)


if __name__ == "__main__":
    main()
