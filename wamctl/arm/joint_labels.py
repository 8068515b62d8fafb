"""Joints by number and short name, as people read them: `joint 4 (elbow pitch)`."""

from collections.abc import Sequence
from itertools import takewhile


def joint_labels(names: Sequence[str]) -> list[str]:
    """Short labels of joints, numbered from 1, without what all names share."""
    start = _shared_start(names) if len(names) > 1 else ""
    end = _shared_start([n[::-1] for n in names])[::-1] if len(names) > 1 else ""
    first = max(start.rfind("/"), start.rfind("_")) + 1
    last = end[end.find("_") :] if "_" in end else ""
    short = [n[first:].removesuffix(last).replace("_", " ") or n for n in names]
    short = [n.replace("_", " ") if "0" in short else s for n, s in zip(names, short, strict=True)]
    return [
        s if s.endswith(str(k)) and len(s) > len(str(k)) else f"{k} {s}".replace(f"{k} {k}", str(k))
        for k, s in enumerate(short, 1)
    ]


def numbered_joints(names: Sequence[str]) -> list[str]:
    """Each joint as a sentence names it: `joint 4 (elbow pitch)`."""
    return [joints_text([label]) for label in joint_labels(names)]


def joints_text(labels: Sequence[str]) -> str:
    """Joints by their labels in a sentence: `joints 2 (lift) and 3`, `joints 1 to 7`."""
    numbers = [int(label) for label in labels if label.isdigit()]
    if 2 < len(labels) == len(numbers) and numbers == [*range(numbers[0], numbers[-1] + 1)]:
        return f"joints {numbers[0]} to {numbers[-1]}"
    names = []
    for label in labels:
        place, _, name = label.removeprefix("joint").strip().partition(" ")
        names.append(f"{place} ({name})" if name else place or label)
    return f"joint{'s' * (len(names) > 1)} {listed(names)}"


def _shared_start(names: Sequence[str]) -> str:
    columns = zip(*names, strict=False)
    return "".join(c[0] for c in takewhile(lambda c: len(set(c)) == 1, columns))


def listed(words: Sequence[str]) -> str:
    """Words in a sentence: `a, b, and c`."""
    if len(words) < 3:
        return " and ".join(words)
    return f"{', '.join(words[:-1])}, and {words[-1]}"
