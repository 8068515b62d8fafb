"""Does a setting of `ident gap` matter? Each one doubled and halved, on blind arms.

Run: .venv/bin/python scripts/benchmarks/gap_settings.py [SECTION.NAME ..] [--runs N] [--seed S]
     [--hidden 0|1|2 ..] [--jobs N]

Without names, all settings. The arms are those of `gap_naming.py`, N of each number of hidden
effects. Every arm in turn is asked with half of the value and with twice as much,
until one answers differently: another verdict, or other names, contacts or suspects. A line for
each setting tells which arm noticed it first, and how its answer changed. Shares stay at one,
counts are rounded.
"""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from gap_cases import KNOWN, MOTION, STRANGE, Run, run
from gap_naming import judged, source_of

from ident.gap.options import Options
from ident.gap.search import search
from ident.gap.settings import GapSettings

FACTORS = (0.5, 2.0)


@dataclass(frozen=True)
class Answer:
    """What a search says, and whether that is right, or wrong and confident."""

    text: str
    right: bool
    wrong: bool

    @property
    def mark(self) -> str:
        """The answer in words."""
        how = "right" if self.right else "WRONG" if self.wrong else "cautious"
        return f"{self.text} ({how})"


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


def answer(recorded: Run, settings: GapSettings) -> Answer:
    """The answer to an arm."""
    verdict = search(
        source_of(recorded.log, None), Options(null_runs=1, settings=settings), lambda _: None
    ).verdict
    found = [(e.candidate.effect, e.candidate.joints) for e in verdict.effects]
    found += [("contact", b.joints) for b in verdict.transients]
    suspects = [(s.candidate.effect, s.candidate.joints) for s in verdict.suspected]
    right, wrong = judged(recorded, verdict.kind, found)
    text = f"{verdict.kind} {_told(found)}" + (f" perhaps {_told(suspects)}" if suspects else "")
    return Answer(text, right, wrong)


def _told(found: list[tuple[str, tuple[int, ...]]]) -> str:
    return ", ".join(f"{name} {'+'.join(str(j + 1) for j in joints)}" for name, joints in found)


def recorded_arms(seeds: range, count: int) -> list[tuple[str, Run]]:
    """The arms of some seeds, but for those that lose their reference."""
    families, found = [*KNOWN, *(STRANGE if count < 2 else ())], []
    for seed in seeds:
        try:
            found.append((f"{seed}/{count}", run(seed, count, 1.0, families, MOTION)))
        except ValueError as error:
            print(f"{seed:5d} not recorded: {error}")
    return found


def noticed(name: str, arms: list[tuple[str, Run]], usual: list[Answer]) -> str:
    """Which arm notices a setting first, and how; empty where none does."""
    for (label, arm), before in zip(arms, usual, strict=True):
        for factor in FACTORS:
            try:
                after = answer(arm, changed(name, factor))
            except (
                ArithmeticError,
                LookupError,
                TypeError,
                ValueError,
            ) as error:  # one setting's failure is its line of the table
                return f"{label} x{factor:g}: fails, {type(error).__name__}: {error}"
            if after.text != before.text:
                return f"{label} x{factor:g}: {before.mark} -> {after.mark}"
    return ""


def main() -> None:
    """Print a line for each setting."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("names", nargs="*", metavar="SECTION.NAME")
    options.add_argument("--runs", type=int, default=4)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--hidden", type=int, nargs="+", choices=(0, 1, 2), default=(1, 0, 2))
    options.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    chosen = options.parse_args()
    unknown = set(chosen.names) - set(names())
    if unknown:
        options.error(f"no settings: {', '.join(sorted(unknown))}")
    seeds = range(chosen.seed, chosen.seed + chosen.runs)
    kinds = [recorded_arms(seeds, count) for count in chosen.hidden]
    arms = [arm for arms in kinds for arm in arms]
    with ProcessPoolExecutor(chosen.jobs) as pool:
        usual = list(pool.map(answer, [arm for _, arm in arms], [GapSettings()] * len(arms)))
        for (label, _), told in zip(arms, usual, strict=True):
            print(f"arm {label}: {told.mark}", flush=True)
        asked = {name: pool.submit(noticed, name, arms, usual) for name in chosen.names or names()}
        for name, told in asked.items():
            print(f"{name:45s} {told.result() or 'not noticed'}", flush=True)


if __name__ == "__main__":
    main()
