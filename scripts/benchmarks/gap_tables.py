"""The blind benchmark's runs, as lines of JSON, and the tables made of them."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.stats import beta, norm

_LEVELS = ((1.0, np.inf), (0.5, 1.0), (0.0, 0.5))
_SURE = float(norm.ppf(0.95))  # standard deviations of a 90 % interval


@dataclass(frozen=True)
class Told:
    """A run and what was said of it.

    Attributes:
        seed: of the run.
        hidden: families.
        places: their joints, from 1.
        sizes: in each family's unit.
        strange: whether one of them is not in the catalogue.
        level: visible part of the residual beside the effect-free arm's, at the joint where it is
            largest; of two effects, that of the one that is less visible by itself.
        verdict: in one word.
        names, joints: what was named, and where, from 1.
        rivals: what could not be told from it.
        unexplained_structures: structure without a name.
        values: value and standard deviation of each effect's parameters, by name.
        truth: what they ought to be, signs left out, where the catalogue has such a parameter.
        closed: part of the held-out gap that was closed, of what the true effect would close.
        right: family and joint, or rightly nothing or unknown.
        wrong: named, and not right.
        seconds: of the search.
    """

    seed: int
    hidden: list[str]
    places: list[list[int]]
    sizes: list[float]
    strange: bool
    level: float
    verdict: str
    names: list[str]
    joints: list[list[int]]
    rivals: list[str]
    unexplained_structures: list[str]
    values: list[dict[str, list[float]]]
    truth: list[dict[str, float]]
    closed: float
    right: bool
    wrong: bool
    seconds: float

    @property
    def line(self) -> str:
        """For people."""
        hidden = zip(self.hidden, self.places, self.sizes, strict=True)
        what = " + ".join(f"{f} {p} {s:.3g}" for f, p, s in hidden) or "nothing"
        said = " + ".join(f"{n} {p}" for n, p in zip(self.names, self.joints, strict=True))
        mark = "ok" if self.right else "WRONG" if self.wrong else "no"
        return (
            f"{self.seed:5d} {mark:5s} level {self.level:7.2f} {what:42s} -> {self.verdict}: {said}"
            f" {'; '.join(self.unexplained_structures)}"
            f" (closed {self.closed:.2f}, {self.seconds:.0f} s)"
        )


def append(path: Path, told: Told) -> None:
    """Write a run."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(told)) + "\n")


def read(paths: Sequence[Path]) -> list[Told]:
    """Runs as written."""
    return [Told(**json.loads(line)) for p in paths for line in p.read_text().splitlines()]


def print_tables(runs: Sequence[Told]) -> None:
    """Confusion matrix, rates by level, and the parameters' errors."""
    print("\nhidden -> said, and how often (level at least 0.5 of the floor)")
    table = Counter(
        (" + ".join(sorted(r.hidden)) or "nothing", _answer(r))
        for r in runs
        if r.level >= 0.5 or not r.hidden
    )
    for (hidden, said), count in sorted(table.items()):
        print(f"  {hidden:45s} {said:60s} {count:4d}")
    _rates("nothing hidden", [r for r in runs if not r.hidden])
    for low, high in _LEVELS:
        inside = [r for r in runs if r.hidden and low <= r.level < high]
        words = f"level {low:g} to {high:g}"
        for count, name in ((1, "one effect"), (2, "two effects")):
            here = [r for r in inside if len(r.hidden) == count]
            _rates(f"{name} of the catalogue, {words}", [r for r in here if not r.strange])
            _rates(f"{name} outside it, {words}", [r for r in here if r.strange])
    _parameters([r for r in runs if len(r.hidden) == 1 and r.right])


def _answer(run: Told) -> str:
    if run.verdict in ("no_gap", "unknown", "data_fault"):
        return run.verdict
    names = "+".join(sorted(set(run.names)))
    return names if run.verdict == "named" else f"ambiguous: {names} or {'/'.join(run.rivals)}"


def _rates(title: str, runs: Sequence[Told]) -> None:
    if not runs:
        return
    right, wrong = sum(r.right for r in runs), sum(r.wrong for r in runs)
    named = sum(r.verdict == "named" for r in runs)
    closed = [r.closed for r in runs if r.right and r.hidden and not r.strange]
    median = f", closed gap median {np.median(closed):.3f}" if closed else ""
    print(
        f"{title}: {len(runs)} runs, right {_share(right, len(runs))},"
        f" wrong and confident {_share(wrong, len(runs))}, named {named}{median}"
    )


def _share(hits: int, runs: int) -> str:
    """A rate with its 95 % Clopper-Pearson interval."""
    low = 0.0 if hits == 0 else float(beta.ppf(0.025, hits, runs - hits + 1))
    high = 1.0 if hits == runs else float(beta.ppf(0.975, hits + 1, runs - hits))
    return f"{hits} = {100 * hits / runs:.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def _parameters(runs: Sequence[Told]) -> None:
    errors: dict[str, list[tuple[float, bool]]] = {}
    for r in runs:
        (family,), (truth,) = r.hidden, r.truth
        for name, value in truth.items():
            for found in (v[name] for v in r.values if name in v):
                size, sd = abs(found[0]), found[1]
                error = abs(size - value) / value
                errors.setdefault(f"{family} {name}", []).append(
                    (error, abs(size - value) <= _SURE * sd)
                )
    for name, pairs in sorted(errors.items()):
        error = np.array([e for e, _ in pairs])
        inside = np.mean([i for _, i in pairs])
        print(
            f"  {name:40s} {len(pairs):3d} values, error median {100 * np.median(error):.1f} %,"
            f" 90 % intervals hold {100 * inside:.0f} %"
        )
