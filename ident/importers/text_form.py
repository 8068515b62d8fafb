"""How a text table is written: its lines as cells."""

import csv
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.signals.arrays import Array
from wamctl.arm.errors import DataError


@dataclass(frozen=True)
class TextForm:
    """The form of a text table.

    Attributes:
        header: whether it starts with names.
        delimiter: between cells; a blank stands for any white space.
        skip: lines before all that.
        last: row of numbers after which nothing is read; None: all are.
    """

    header: bool = True
    delimiter: str = ","
    skip: int = 0
    last: int | None = None

    @property
    def before(self) -> int:
        """Lines before the first row of numbers."""
        return self.skip + self.header

    @property
    def blank(self) -> bool:
        """Whether any white space parts the cells."""
        return self.delimiter == " "

    def lines(self, path: Path, first: int) -> Iterator[tuple[int, list[str]]]:
        """The lines with anything in them from a number on, counted from 0: number from 1, cells.

        Raises:
            OSError, UnicodeDecodeError, csv.Error: a file that is no text table.
        """
        with path.open(encoding="utf-8-sig", newline="") as stream:
            if self.blank:
                lines = enumerate((line.split() for line in stream), 1)
            else:
                reader = csv.reader(stream, delimiter=self.delimiter)
                lines = ((reader.line_num, cells) for cells in reader)
            yield from (line for line in itertools.islice(lines, first, None) if line[1])

    def rows(self, path: Path) -> Iterator[tuple[int, list[str]]]:
        """The rows of numbers: number of the line from 1, cells; raises as `lines` does."""
        return itertools.islice(self.lines(path, self.before), self.last)


def is_number(cell: str) -> bool:
    """Whether a cell, or a word, is a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def is_vector(cell: str) -> bool:
    """Whether a cell is written as a vector."""
    return cell.strip().startswith("[")


def vectors(path: Path, name: str | int, place: int, form: TextForm) -> Array:
    """A column of vectors, shape (S, n).

    Raises:
        DataError: a cell that is no vector of numbers, or another number of them.
    """
    rows: list[list[float]] = []
    for number, line in form.rows(path):
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
