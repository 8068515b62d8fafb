"""Does a setting of `ident gap` matter? Each one doubled and halved, on blind arms.

Run: .venv/bin/python scripts/benchmarks/gap_settings.py [SECTION.NAME ..] [--runs N] [--seed S]
     [--hidden 0|1|2] [--jobs N]

Without names, all settings. The arms are those of `gap_naming.py`; each is recorded once. A line is
printed for each setting: answers that are right, and that are wrong and confident, with half of its
value, the value itself, and twice as much. Shares stay at one, counts are rounded. A setting whose
three pairs are equal was not noticed by these arms: take more of them before it is dropped.
"""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial

from gap_cases import KNOWN, MOTION, STRANGE, Run, run
from gap_naming import judged, source_of

from ident.gap.options import Options
from ident.gap.search import search
from ident.gap.settings import GapSettings

FACTORS = (0.5, 1.0, 2.0)


def names() -> list[str]:
    """All settings, as SECTION.NAME."""
    return [
        f"{section}.{name}"
        for section, values in GapSettings().model_dump().items()
        for name in values
    ]


def changed(name: str, factor: float) -> GapSettings:
    """The settings with one of them multiplied, within its bounds."""
    values = GapSettings().model_dump()
    section, key = name.split(".")
    value = values[section][key]
    scaled = max(1, round(value * factor)) if isinstance(value, int) else value * factor
    largest = GapSettings.model_json_schema()["$defs"]
    titles = {s: type(getattr(GapSettings(), s)).__name__ for s in values}
    bound = largest[titles[section]]["properties"][key].get("maximum")
    values[section][key] = scaled if bound is None else min(scaled, bound)
    return GapSettings.model_validate(values)


def answer(recorded: Run, null_runs: int, settings: GapSettings) -> tuple[bool, bool]:
    """Whether the answer is right, and whether it is wrong and confident."""
    options = Options(null_runs=null_runs, settings=settings)
    verdict = search(source_of(recorded.log, None), options, lambda _: None).verdict
    named = [(e.candidate.effect, e.candidate.joints) for e in verdict.effects]
    named += [("contact", b.joints) for b in verdict.transients]
    return judged(recorded, verdict.kind, named)


def recorded_arms(seeds: range, hidden: int) -> list[Run]:
    """The arms of some seeds, but for those that lose their reference."""
    families, found = [*KNOWN, *(STRANGE if hidden < 2 else ())], []
    for seed in seeds:
        try:
            found.append(run(seed, hidden, 1.0, families, MOTION))
        except ValueError as error:
            print(f"{seed:5d} not recorded: {error}")
    return found


def main() -> None:
    """Print a line for each setting."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("names", nargs="*", metavar="SECTION.NAME")
    options.add_argument("--runs", type=int, default=8)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--hidden", type=int, choices=(0, 1, 2), default=1)
    options.add_argument("--null-runs", type=int, default=1)
    options.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    chosen = options.parse_args()
    unknown = set(chosen.names) - set(names())
    if unknown:
        options.error(f"no settings: {', '.join(sorted(unknown))}")
    arms = recorded_arms(range(chosen.seed, chosen.seed + chosen.runs), chosen.hidden)
    print(
        f"{len(arms)} arms; right and wrong-and-confident answers at 0.5, 1 and 2 times the value"
    )
    with ProcessPoolExecutor(chosen.jobs) as pool:
        for name in chosen.names or names():
            cells = []
            for factor in FACTORS:
                ask = partial(answer, null_runs=chosen.null_runs, settings=changed(name, factor))
                answers = list(pool.map(ask, arms))
                cells.append(f"{sum(r for r, _ in answers)}/{sum(w for _, w in answers)}")
            print(f"{name:45s} {'  '.join(cells)}", flush=True)


if __name__ == "__main__":
    main()
