"""How a text table is written: its lines as cells."""

import csv
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

_HEAD = 40  # lines that are looked at
_COMMENTS = ("#", "%")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


def encoding(path: Path) -> str:
    """That of a text table: UTF-16 where its first bytes say so, else UTF-8."""
    with path.open("rb") as stream:
        return "utf-16" if stream.read(2) in _UTF16 else "utf-8-sig"


@dataclass(frozen=True)
class TextForm:
    """The form of a text table.

    Attributes:
        header: whether it starts with names.
        delimiter: between cells; a blank stands for any white space.
        skip: lines before all that.
        last: row of numbers after which nothing is read; None: all are.
        units: whether a line of units stands below the names.
    """

    header: bool = True
    delimiter: str = ","
    skip: int = 0
    last: int | None = None
    units: bool = False

    @property
    def before(self) -> int:
        """Lines before the first row of numbers."""
        return self.skip + self.header + self.units

    @property
    def blank(self) -> bool:
        """Whether any white space parts the cells."""
        return self.delimiter == " "

    def lines(self, path: Path, first: int) -> Iterator[tuple[int, list[str]]]:
        """The lines with anything in them from a number on, counted from 0: number from 1, cells.

        Raises:
            OSError, UnicodeError, csv.Error: a file that is no text table.
        """
        with path.open(encoding=encoding(path), newline="") as stream:
            if self.blank:
                lines = enumerate((line.split() for line in stream), 1)
            else:
                reader = csv.reader(stream, delimiter=self.delimiter)
                lines = ((reader.line_num, cells) for cells in reader)
            yield from (line for line in itertools.islice(lines, first, None) if line[1])

    def rows(self, path: Path) -> Iterator[tuple[int, list[str]]]:
        """The rows of numbers: number of the line from 1, cells; raises as `lines` does."""
        return itertools.islice(self.lines(path, self.before), self.last)

    def as_in(self, path: Path) -> "TextForm":
        """The form that the head of a table shows, where the mapping leaves it open.

        Comments before the names are passed over, and units below them; semicolons or tabs part the
        cells where the line of names has no comma.

        Raises:
            OSError, UnicodeError: a file that is no text.
        """
        if not self.header:
            return self
        with path.open(encoding=encoding(path)) as stream:
            head = list(itertools.islice(stream, self.skip, self.skip + _HEAD))
        if not head:
            return self
        head = [line.strip() for line in head]
        k, last = 0, len(head) - 1
        while k < last and head[k].startswith(_COMMENTS) and not _numbers(self.cells(head[k + 1])):
            k += 1
        parted = [d for d in (";", "\t") if d in head[k] and self.delimiter == ","]
        found = replace(self, skip=self.skip + k)
        if parted and "," not in head[k]:
            found = replace(found, delimiter=parted[0])
        below = [found.cells(line) for line in head[k + 1 : k + 3]]
        units = len(below) == 2 and any(below[0]) and not _numbers(below[0]) and _numbers(below[1])
        return replace(found, units=units)

    def cells(self, line: str) -> list[str]:
        """The cells of a line, as far as quotes hold no delimiter."""
        return line.split(None if self.blank else self.delimiter)


def _numbers(cells: Sequence[str]) -> bool:
    """Whether some cell is a number."""
    return any(map(is_number, cells))


def number_in(cell: str) -> float:
    """A cell's number; a decimal comma is a point.

    Raises:
        ValueError: it is none.
    """
    return float(cell.replace(",", "."))


def is_number(cell: str) -> bool:
    """Whether a cell, or a word, is a number."""
    try:
        number_in(cell)
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
