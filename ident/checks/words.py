"""Words that the sentences of remarks share."""

from collections.abc import Iterable, Sequence


def joined(words: Sequence[str]) -> str:
    """Words as a list in a sentence."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def joints(places: Iterable[int], names: Sequence[str]) -> str:
    """Joints by number and name; places count from 0."""
    found = [f"{k + 1} ({names[k]})" for k in places]
    return f"joint{'s' * (len(found) > 1)} {joined(found)}"


def numbers(places: Iterable[int]) -> tuple[int, ...]:
    """Joints as remarks hold them, from 1."""
    return tuple(int(k) + 1 for k in places)
