"""Do two states of the program give the same results?

    python scripts/benchmarks/same_results.py BEFORE AFTER

BEFORE and AFTER are folders that hold results of the same commands on the same logs (any depth):
`run.json`, `gap.json`, `validate.json`, `model.yaml`. Times, settings, provenance and paths are
left out; every other number, name and sentence has to be the same (numbers to a relative 1e-9,
which allows for sums in another order). Prints each difference; ends with 1 if there is one.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

LEFT_OUT = {"seconds", "settings", "provenance", "logs", "model"}
NAMES = ("run.json", "gap.json", "validate.json", "model.yaml")


def content(path: Path) -> Any:
    """A result file's content."""
    text = path.read_text(encoding="utf-8")
    return json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)


def differences(one: Any, two: Any, place: str = "") -> Iterator[str]:
    """Sentences, one for each place in which two contents differ."""
    if isinstance(one, dict) and isinstance(two, dict):
        for key in sorted((one.keys() | two.keys()) - LEFT_OUT):
            if key not in one or key not in two:
                yield f"{place}.{key}: only {'after' if key in two else 'before'}"
            else:
                yield from differences(one[key], two[key], f"{place}.{key}")
    elif isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        for i, (a, b) in enumerate(zip(one, two, strict=True)):
            yield from differences(a, b, f"{place}[{i}]")
    elif isinstance(one, float) and isinstance(two, float):
        if not math.isclose(one, two, rel_tol=1e-9, abs_tol=1e-12):
            yield f"{place}: {one!r} before, {two!r} after"
    elif one != two:
        yield f"{place}: {str(one)[:80]!r} before, {str(two)[:80]!r} after"


def main() -> int:
    """Compare two folders of results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    given = parser.parse_args()
    files = sorted(p for name in NAMES for p in given.before.rglob(name))
    if not files:
        parser.error(f"{given.before} holds none of {', '.join(NAMES)}")
    count = 0
    for path in files:
        other = given.after / path.relative_to(given.before)
        if not other.exists():
            print(f"{other}: missing")
            count += 1
            continue
        for sentence in differences(content(path), content(other)):
            print(f"{path.relative_to(given.before)}{sentence}")
            count += 1
    print(f"{len(files)} files compared, {count} differences")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
