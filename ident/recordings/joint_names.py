"""Joints that a recording calls otherwise than the arm: as told, or matched beyond doubt."""

import re
from collections import defaultdict
from collections.abc import Sequence

Pairs = tuple[tuple[str, str], ...]
"""Names as recorded, each with the name that the arm has for it."""

_NUMBER = re.compile(r"\d+(?=\D*$)")


def renamed(names: Sequence[str], wanted: Sequence[str], rules: Sequence[tuple[str, str]]) -> Pairs:
    """The arm's names of recorded joints, where they differ.

    Args:
        names: joints as recorded.
        wanted: the arm's joints.
        rules: parts of names and what they are to be replaced by; none: names are matched where
            none of them is the arm's and one numbering or one prefix leaves no doubt.
    """
    if rules:
        changed = [(name, _replaced(name, rules)) for name in names]
        return tuple((old, new) for old, new in changed if old != new)
    if set(names) & set(wanted):
        return ()
    return _by_prefix(names, wanted) or _by_number(names, wanted)


def _replaced(name: str, rules: Sequence[tuple[str, str]]) -> str:
    for old, new in rules:
        name = name.replace(old, new)
    return name


def _by_prefix(names: Sequence[str], wanted: Sequence[str]) -> Pairs:
    """Names that are the arm's behind one prefix, such as a namespace, or the other way round."""
    for longer, shorter, turned in ((names, wanted, False), (wanted, names, True)):
        prefixes = {
            a.removesuffix(b) for a in longer for b in shorter if a.endswith(b) and a != b and b
        }
        for prefix in prefixes:
            pairs = [(a, a.removeprefix(prefix)) for a in longer if a.startswith(prefix)]
            found = [(a, b) for a, b in pairs if b in shorter]
            if len(found) == len(names if turned else wanted) > 1:
                return tuple((b, a) if turned else (a, b) for a, b in found)
    return ()


def _by_number(names: Sequence[str], wanted: Sequence[str]) -> Pairs:
    """Names of one pattern with the same numbers as the arm's: fer_joint1 and panda_joint1."""
    recorded, own = _largest_family(names), _largest_family(wanted)
    if len(own) < 2 or set(recorded) != set(own):
        return ()
    return tuple((recorded[number], own[number]) for number in own)


def _largest_family(names: Sequence[str]) -> dict[int, str]:
    """Those of the names that differ in their last number only, by that number."""
    families: dict[str, dict[int, str]] = defaultdict(dict)
    for name in names:
        found = _NUMBER.search(name)
        if found:
            pattern = f"{name[: found.start()]}#{name[found.end() :]}"
            families[pattern][int(found.group())] = name
    sizes = sorted((len(f) for f in families.values()), reverse=True)
    if not sizes or sizes[1:2] == sizes[:1]:
        return {}
    return max(families.values(), key=len)
