"""Text tables whose cells hold a vector each, such as `[0.1, 0.2]`: what a data frame writes."""

import csv
import itertools
from pathlib import Path

import numpy as np

from ident.signals.arrays import Array
from wamctl.arm.errors import DataError


def is_vector(cell: str) -> bool:
    """Whether a cell is written as a vector."""
    return cell.strip().startswith("[")


def vectors(path: Path, name: str | int, place: int, *, header: bool, delimiter: str) -> Array:
    """A column of vectors, shape (S, n).

    Raises:
        DataError: a cell that is no vector of numbers, or another number of them.
    """
    rows: list[list[float]] = []
    with path.open(encoding="utf-8-sig", newline="") as stream:
        lines = csv.reader(stream, delimiter=delimiter)
        for line in itertools.islice(lines, 1 if header else 0, None):
            if not line:
                continue
            try:
                row = [float(x) for x in line[place].strip(" []").replace(",", " ").split()]
            except (ValueError, IndexError):
                row = []
            if not row or (rows and len(row) != len(rows[0])):
                raise DataError(
                    f"{path}, line {lines.line_num}, column {name!r}: not a vector of"
                    f" {len(rows[0]) if rows else 'some'} numbers."
                )
            rows.append(row)
    return np.array(rows)
