"""Text tables whose cells hold a vector each, such as `[0.1, 0.2]`: what a data frame writes."""

from pathlib import Path

import numpy as np

from ident.importers.text_form import TextForm
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError


def is_vector(cell: str) -> bool:
    """Whether a cell is written as a vector."""
    return cell.strip().startswith("[")


def vectors(path: Path, name: str | int, place: int, form: TextForm) -> Array:
    """A column of vectors, shape (S, n).

    Raises:
        DataError: a cell that is no vector of numbers, or another number of them.
    """
    rows: list[list[float]] = []
    for number, line in form.lines(path, form.before):
        try:
            row = [float(x) for x in line[place].strip(" []").replace(",", " ").split()]
        except (ValueError, IndexError):
            row = []
        if not row or (rows and len(row) != len(rows[0])):
            raise DataError(
                f"{path}, line {number}, column {name!r}: not a vector of"
                f" {len(rows[0]) if rows else 'some'} numbers."
            )
        rows.append(row)
    return np.array(rows)
