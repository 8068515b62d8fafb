"""Times that a text table writes as dates, such as 2024-01-31T12:00:00.020."""

import re
from pathlib import Path

import numpy as np

from ident.importers.text_form import TextForm
from wamctl.arm.errors import DataError

_DATE = re.compile(
    r"((?:19|20)\d\d-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d+)?)?) ?(Z|UTC|[+-]\d\d:?\d\d)?", re.I
)


def is_date(cell: str) -> bool:
    """Whether a cell is written as a date with a time, with or without a time zone."""
    return _DATE.fullmatch(cell.strip()) is not None


def dates(path: Path, name: str | int, place: int, form: TextForm) -> np.ndarray:
    """A column of dates, shape (S,), as instants [ns]; without a time zone they are taken as UTC.

    Raises:
        DataError: a cell that is no date.
    """
    found = []
    for number, line in form.rows(path):
        cell = line[place].strip() if place < len(line) else ""
        try:
            found.append(_instant(cell))
        except ValueError as error:
            raise DataError(
                f"{path}, line {number}, column {name!r}: {cell[:40]!r} is no date such as"
                " 2024-01-31T12:00:00.020, as other rows have there; a line that was torn can be"
                " deleted: what it leaves is told as missing."
            ) from error
    return np.array(found, dtype="datetime64[ns]")


def _instant(cell: str) -> np.datetime64:
    """The instant of a date.

    Raises:
        ValueError: it is none.
    """
    match = _DATE.fullmatch(cell)
    if match is None:
        raise ValueError(cell)
    instant, zone = np.datetime64(match[1].upper().replace(",", "."), "ns"), match[2] or "Z"
    if zone[0] not in "+-":
        return instant
    ahead = np.timedelta64(60 * int(zone[1:3]) + int(zone[-2:]), "m")
    return instant - ahead if zone[0] == "+" else instant + ahead
