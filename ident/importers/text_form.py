"""How a text table is written: its lines as cells."""

import csv
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class TextForm:
    """The form of a text table.

    Attributes:
        header: whether it starts with names.
        delimiter: between cells; a blank stands for any white space.
        skip: lines before all that.
    """

    header: bool = True
    delimiter: str = ","
    skip: int = 0

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
