"""Columns of a text table, as numbers, vectors or dates."""

import csv
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from ident.importers.dates import dates, is_date
from ident.importers.text_form import TextForm, encoding, is_number, is_vector, number_in, vectors
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

_SHOWN = 40  # characters of a cell, in a message


def read_text_table(
    path: Path, wanted: Sequence[str | int], form: TextForm
) -> tuple[dict[str | int, np.ndarray], tuple[str, ...]]:
    """Wanted columns that are there, and the names of all.

    Raises:
        DataError: no text, no rows, or a cell that is no number.
    """
    try:
        return _read(path, wanted, form.as_in(path))
    except (OSError, UnicodeError, csv.Error) as error:
        raise DataError(f"{path} is not a readable text table ({error}).") from error


def _read(
    path: Path, wanted: Sequence[str | int], form: TextForm
) -> tuple[dict[str | int, np.ndarray], tuple[str, ...]]:
    first = next((cells for _, cells in form.lines(path, form.skip)), [])
    sample = next((cells for _, cells in form.lines(path, form.before)), [])
    if not sample:
        below = "below its header" if form.header else "of numbers"
        raise DataError(f"{path} has no rows {below}: give a table with rows.")
    names = tuple(name.strip().lstrip("#%").strip() for name in first) if form.header else ()
    by_number = all(isinstance(c, int) and 1 <= c <= len(first) for c in wanted)
    if by_number and _are_values(names):
        raise DataError(
            f"{path}: the first line holds numbers, and would be lost as a header: write"
            " `header: false` in the mapping, or names into that line."
        )
    places = {}
    for column in wanted:
        if isinstance(column, int) and 1 <= column <= len(first):
            places[column] = column - 1
        elif column in names:
            places[column] = names.index(str(column))
            _one_of_that_name(path, names, str(column))
    available = names or tuple(str(k + 1) for k in range(len(first)))
    made: dict[str | int, np.ndarray] = {}
    for column, place in places.items():
        for kind, read in ((is_vector, vectors), (is_date, dates)):
            if place < len(sample) and kind(sample[place]):
                made[column] = read(path, column, place, form)
    places = {column: place for column, place in places.items() if column not in made}
    if not places:
        return made, available
    try:
        rows = _rows(path, list(places.values()), form)
    except ValueError as error:
        raise DataError(_bad_cell(path, places, form) or f"{path}: {error}.") from error
    return made | dict(zip(places, rows.T, strict=True)), available


def _are_values(names: Sequence[str]) -> bool:
    """Whether a header holds dates, or numbers that are no count of the columns."""
    dated = [is_date(name) for name in names]
    if not names or not all(d or is_number(name) for d, name in zip(dated, names, strict=True)):
        return False
    if any(dated):
        return True
    numbers = np.array(names, dtype=float)
    return bool((np.diff(numbers) != 1.0).any() or numbers[0] not in (0.0, 1.0))


def _one_of_that_name(path: Path, names: Sequence[str], name: str) -> None:
    """Refuses a name that tells no column.

    Raises:
        DataError: several columns have it.
    """
    places = [str(k) for k, other in enumerate(names, 1) if other == name]
    if len(places) > 1:
        raise DataError(
            f"{path}: the columns {', '.join(places[:-1])} and {places[-1]} are"
            f" {'both' if len(places) == 2 else 'all'} called {name!r}: write the number of the"
            " one that is meant, or rename them."
        )


def _rows(path: Path, places: Sequence[int], form: TextForm) -> Array:
    """The numbers of some columns, shape (S, columns); with decimal commas, or points."""
    read = partial(
        np.loadtxt,
        path,
        delimiter=None if form.blank else form.delimiter,
        skiprows=form.before,
        max_rows=form.last,
        usecols=places,
        ndmin=2,
        encoding=encoding(path),
        quotechar='"',
        comments=None,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of blank lines, which are no rows to `rows.last` either
        try:
            return read()
        except ValueError:
            if form.delimiter == ",":
                raise
            return read(converters=number_in)


def _short(cell: str) -> str:
    return repr(cell if len(cell) <= _SHOWN else f"{cell[:_SHOWN]}…")


def _bad_cell(path: Path, places: dict[str | int, int], form: TextForm) -> str | None:
    """A sentence on the first cell that is no number."""
    rows = form.rows(path)
    for count, (number, line) in enumerate(rows):
        for name, place in places.items():
            if place >= len(line):
                fault = (
                    f"{path}, line {number}: {len(line)} columns, so that column {name!r} is"
                    " missing"
                )
            elif not is_number(line[place]):
                fault = (
                    f"{path}, line {number}, column {name!r}: {_short(line[place])} is not a number"
                )
                if all(map(is_number, line[place].split())):
                    fault += "; where white space separates columns, write `delimiter: ' '`"
            else:
                continue
            if count and next(rows, None) is None:
                fault += f"; a last row that was cut off is left out by rows.last: {count}"
            elif count:
                fault += "; a line that was torn can be deleted: what it leaves is told as missing"
            return f"{fault}."
    return None
