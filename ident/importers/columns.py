"""The mapped columns of one table or several: found, of one length, and finite."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.importers.clock import stamps
from ident.importers.dates import is_date
from ident.importers.mapping import Mapping, SeriesSection, TimeSection
from ident.importers.shared_columns import Use, shared_columns
from ident.importers.tables import Name, Table, read_table
from ident.importers.text_form import TextForm, is_number
from ident.signals.arrays import Array
from wamctl.arm.errors import ConfigurationError, DataError

_MOST_LEFT_OUT = 0.1
"""Of the rows, that may hold cells that are not finite."""


@dataclass(frozen=True)
class MappedColumns:
    """The chosen rows, as the tables have them.

    Attributes:
        stamp_ns: instants [ns], shape (S,).
        series: per quantity of the mapping its columns, shape (S, n).
        rows: the table's number of each, from 1, shape (S,).
        left_out: rows that were left out, since a cell of theirs is not finite.
    """

    stamp_ns: NDArray[np.int64]
    series: dict[str, Array]
    rows: NDArray[np.intp]
    left_out: tuple[int, ...] = ()


def files(source: Path, plan: Mapping) -> list[Path]:
    """The imported table, and those beside it that the mapping joins to it."""
    series = [path for _, part in plan.series() for path, _ in _places(source, part)]
    return list(dict.fromkeys([source, _clock(source, plan.time), *series]))


def read_columns(
    source: Path, plan: Mapping, where: Path, joints: tuple[str, ...]
) -> MappedColumns:
    """The columns that the mapping names.

    Args:
        source: the imported table.
        plan: the mapping.
        where: its file.
        joints: their names, one for each column of a quantity.

    Raises:
        ConfigurationError: everything in which mapping, joints and tables do not fit, at once.
        DataError: unreadable table, cells that are no finite numbers, or no rows.
    """
    tables, n = _tables(source, plan), len(joints)
    faults = plan.lengths(n)
    series: dict[str, np.ndarray] = {}
    for place, part in plan.series():
        found = _stacked(part, _places(source, part), tables, n)
        if isinstance(found, str):
            faults.append(f"{place}.columns: {found}")
        else:
            series[place] = found
    time, clock = plan.time.column, _clock(source, plan.time)
    if time is not None and time not in tables[clock].columns:
        faults.append(f"time.column: {clock.name} {_lacks([time], tables[clock])}")
    elif time is not None:
        series["time"] = tables[clock].columns[time].reshape(-1, 1)
    which = plan.rows.column
    if which is not None and which not in tables[source].columns:
        faults.append(f"rows.column: {source.name} {_lacks([which], tables[source])}")
    elif which is not None and tables[source].columns[which].dtype.kind == "M":
        faults.append(f"rows.column: {_dated([which])}")
    elif which is not None:
        series["rows"] = tables[source].columns[which].reshape(-1, 1)
    rows = slice(plan.rows.first - 1, plan.rows.last)
    taken = {place: values[rows] for place, values in series.items()}
    faults += shared_columns(_uses(source, plan, tables, taken, joints))
    if len({len(values[rows]) for values in series.values()}) > 1:
        listed = ", ".join(f"{place} {len(values)}" for place, values in series.items())
        least = min(map(len, series.values()))
        faults.append(
            f"the columns have different numbers of rows: {listed} (rows.last: {least} takes those"
            " that all have)"
        )
    if faults:
        raise ConfigurationError(where, faults)
    return _chosen_rows(source, plan, series)


def _clock(source: Path, part: TimeSection) -> Path:
    return source if part.file is None else source.parent / part.file


def _places(source: Path, part: SeriesSection) -> list[tuple[Path, Name]]:
    """Each column's table and name."""
    names = (part.columns,) if isinstance(part.columns, str) else part.columns
    files = part.file if isinstance(part.file, tuple) else [part.file] * len(names)
    paths = [source if file is None else source.parent / file for file in files]
    return list(zip(paths, names, strict=True))


def _tables(source: Path, plan: Mapping) -> dict[Path, Table]:
    wanted: dict[Path, list[Name]] = {path: [] for path in files(source, plan)}
    if plan.time.column is not None:
        wanted[_clock(source, plan.time)].append(plan.time.column)
    if plan.rows.column is not None:
        wanted[source].append(plan.rows.column)
    for _, part in plan.series():
        for path, name in _places(source, part):
            wanted[path].append(name)
    form = TextForm(plan.header, plan.delimiter, plan.skip, plan.rows.last)
    return {path: read_table(path, names, form) for path, names in wanted.items()}


def _stacked(
    part: SeriesSection, places: list[tuple[Path, Name]], tables: dict[Path, Table], n: int
) -> Array | str:
    """The columns side by side, shape (S, n), or what their file does wrong."""
    for path in dict.fromkeys(path for path, _ in places):
        own = [name for other, name in places if other == path]
        if missing := [name for name in own if name not in tables[path].columns]:
            return f"{path.name} {_lacks(missing, tables[path])}"
    arrays = [tables[path].columns[name] for path, name in places]
    if dated := [name for (_, name), a in zip(places, arrays, strict=True) if a.dtype.kind == "M"]:
        return _dated(dated)
    where = places[0][0].name
    if not isinstance(part.columns, str):
        shapes = dict.fromkeys(a.shape for a in arrays)
        if len(shapes) == 1 and arrays[0].ndim == 1:
            return np.column_stack(arrays)
        return f"{where} has there shapes {', '.join(map(str, shapes))}, not vectors of one length"
    array = arrays[0].reshape(-1, 1) if arrays[0].ndim == 1 else arrays[0]
    if part.entries and array.ndim == 2:
        if max(part.entries) <= len(array) < array.shape[1]:
            array = array.T  # one row for each channel, as Simulink writes them
        if max(part.entries) <= array.shape[1]:
            return array[:, np.array(part.entries) - 1]
    if array.ndim == 2 and array.shape[1] == n:
        return array
    if array.ndim == 2 and array.shape[0] == n:
        return array.T
    return (
        f"{where} has there shape {array.shape} for {n} joints (entries chooses columns of an"
        " array)"
    )


def _dated(names: list[Name]) -> str:
    return f"{', '.join(map(repr, names))} holds dates there, not numbers"


def _uses(
    source: Path,
    plan: Mapping,
    tables: dict[Path, Table],
    series: dict[str, np.ndarray],
    joints: tuple[str, ...],
) -> Iterator[Use]:
    """What each column that was found stands for."""
    time = plan.time.column
    if time is not None and "time" in series:
        path = _clock(source, plan.time)
        at = (path, tables[path].number(time), 1)
        yield Use("time", "", repr(time), at, series["time"][:, 0])
    for place, part in plan.series():
        if place not in series or series[place].shape[1] != len(joints):
            continue
        columns = [(path, name, 1) for path, name in _places(source, part)]
        if isinstance(part.columns, str):
            (path, name, _), entries = columns[0], part.entries or range(1, len(joints) + 1)
            columns = [(path, name, entry) for entry in entries]
        for k, (path, name, entry) in enumerate(columns):
            joint = f"motor {k + 1}" if part.side == "motor" else joints[k]
            told = f"column {name}" if isinstance(name, int) else repr(name)
            told = f"column {entry} of {told}" if part.entries else told
            at = (path, tables[path].number(name), entry)
            yield Use(place, joint, told, at, series[place][:, k])


def _lacks(names: list[Name], table: Table) -> str:
    wanted, there = ", ".join(map(repr, names)), ", ".join(table.available)
    if all(is_number(name) or is_date(name) for name in table.available):
        return (
            f"has no column {wanted}, and its first line holds numbers: if it is no header, write"
            f" `header: false` and count the columns from 1 to {len(table.available)}"
        )
    return f"has no column {wanted}; its columns are {there}"


def _chosen_rows(source: Path, plan: Mapping, series: dict[str, np.ndarray]) -> MappedColumns:
    have = len(series["position"])
    numbers = np.arange(1, have + 1)[plan.rows.first - 1 : plan.rows.last]
    if not len(numbers):
        raise DataError(f"{source} has {have} rows; rows.first is {plan.rows.first}.")
    if "rows" in series:
        numbers = numbers[series["rows"].ravel()[numbers - 1] == plan.rows.equal]
        if not len(numbers):
            raise DataError(f"{source} has no row with {plan.rows.column!r} = {plan.rows.equal:g}.")
    chosen = {place: v[numbers - 1] for place, v in series.items() if place != "rows"}
    finite = _finite(source, chosen, numbers)
    if "time" in chosen:
        column, position = chosen.pop("time").ravel()[finite], chosen["position"][finite]
        instants = stamps(source, column, plan.time.unit, position)
    else:
        steps = np.flatnonzero(finite) * (1e9 / (plan.time.rate_hz or 1.0))
        instants = np.rint(steps).astype(np.int64)
    kept = {place: values[finite] for place, values in chosen.items()}
    return MappedColumns(instants, kept, numbers[finite], tuple(numbers[~finite].tolist()))


def _finite(
    source: Path, chosen: dict[str, np.ndarray], rows: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Rows of finite cells, shape (S,).

    Raises:
        DataError: so many others that columns or rows are the wrong ones.
    """
    finite = np.ones(len(rows), dtype=bool)
    for values in chosen.values():
        finite &= np.isfinite(values).reshape(len(rows), -1).all(axis=1)
    if (~finite).sum() <= _MOST_LEFT_OUT * len(rows):
        return finite
    place, values = next((p, v) for p, v in chosen.items() if not np.isfinite(v).all())
    bad = np.argwhere(~np.isfinite(values.reshape(len(rows), -1)))
    raise DataError(
        f"{source}: {place} is not finite in {len(bad)} cells, the first in row {rows[bad[0, 0]]},"
        f" joint {bad[0, 1] + 1}; choose other rows in the mapping."
    )
