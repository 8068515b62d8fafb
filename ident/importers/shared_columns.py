"""Columns that a mapping names for more than one thing, as slips of the pen do."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ident.signals.arrays import Array


class Use(NamedTuple):
    """What one column of a table stands for.

    Attributes:
        place: the quantity, a key of the mapping.
        joint: the joint or motor that it is of; empty for the time.
        name: the column as the mapping calls it.
        column: table, number of the column in it, and number within an array.
        values: its numbers, shape (S,).
    """

    place: str
    joint: str
    name: str
    column: tuple[Path, int, int]
    values: Array


def shared_columns(uses: Iterable[Use]) -> list[str]:
    """A sentence for each column given to several joints, and for quantities that share columns.

    A column that never changes may stand for all joints that are held.
    """
    owners: dict[tuple[Path, int, int], dict[str, list[Use]]] = {}
    for use in uses:
        if not _constant(use.values):
            owners.setdefault(use.column, {}).setdefault(use.place, []).append(use)
    within = [sentence for places in owners.values() for sentence in _within(places)]
    across: dict[tuple[str, str], dict[str, list[str]]] = {}
    for places in owners.values():
        first, *others = places
        for other in others:
            for use in places[other]:
                named = across.setdefault((first, other), {})
                named.setdefault(use.name, []).append(use.joint)
    return within + [
        f"{other}.columns: {_listed(named)} {'stand' if len(named) > 1 else 'stands'} under"
        f" {first} as well; each quantity has columns of its own"
        for (first, other), named in across.items()
    ]


def _within(places: dict[str, list[Use]]) -> Iterator[str]:
    for place, found in places.items():
        if len(found) > 1:
            *most, last = (use.joint for use in found)
            yield (
                f"{place}.columns: {found[0].name} is given for {', '.join(most)} and {last}; each"
                " joint has a column of its own"
            )


def _listed(named: dict[str, list[str]]) -> str:
    return ", ".join(f"{name} ({', '.join(joints)})" for name, joints in named.items())


def _constant(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return not len(finite) or bool((finite == finite[0]).all())
