"""Columns of foreign tables: text, Parquet, NumPy archives, MATLAB files of both kinds."""

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import scipy.io
from scipy.io.matlab import MatReadError

from ident.importers.text_form import TextForm
from ident.importers.text_table import read_text_table
from wamctl.arm.errors import DataError
from wamctl.arm.ros2.bounds import Allowance

Name = str | int

_UNREADABLE = (
    OSError, ValueError, TypeError, NotImplementedError, MemoryError, OverflowError, KeyError,
    RecursionError, zlib.error, MatReadError,
)  # fmt: skip
_STEP = 1 << 20
_COMPRESSED, _MAT_HEADER, _MAT_TAG = 15, 128, struct.Struct("<II")
_OBJECT = 3  # of MATLAB_object_decode: the values of a class, in an encoding of MATLAB's own
_HDF5 = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class Table:
    """The wanted columns of one file.

    Attributes:
        columns: by name, or by number from 1: vectors of shape (S,), or arrays (S, n) of a binary
            file, of numbers or of instants (datetime64). A wanted column that is not there is left
            out.
        available: the names that the file has.
    """

    columns: dict[Name, np.ndarray]
    available: tuple[str, ...]

    def number(self, column: Name) -> int:
        """Number from 1 of a column that is there."""
        return column if isinstance(column, int) else self.available.index(column) + 1


def read_table(path: Path, wanted: Sequence[Name], form: TextForm) -> Table:
    """Columns of a file; its form follows from its ending (.npz, .npy, .mat, .parquet, else text).

    Args:
        path: the file.
        wanted: columns by name, or by number from 1.
        form: of a text table.

    Raises:
        DataError: missing or unreadable file, or a cell that is no number.
    """
    if not path.is_file():
        raise DataError(f"{path} does not exist: give the table to import.")
    if not path.stat().st_size:
        raise DataError(f"{path} is empty: give a table with rows.")
    match path.suffix.lower():
        case ".npz":
            return _table(_npz(path), wanted, path)
        case ".npy":
            return _table(_npy(path), wanted, path)
        case ".mat":
            return _table(_mat(path), wanted, path)
        case ".parquet":
            columns, names = read_parquet(path, wanted)
            return replace(_table(columns, wanted, path), available=names)
        case ".xlsx" | ".xlsm" | ".xls" | ".ods":
            raise DataError(f"{path} is a workbook of a spreadsheet: save its sheet as CSV.")
        case _:
            return Table(*read_text_table(path, wanted, form))


def _npz(path: Path) -> dict[str, Any]:
    try:
        with ZipFile(path) as archive:
            Allowance.of(path).take(sum(entry.file_size for entry in archive.infolist()))
        with np.load(path) as archive:
            return dict(archive.items())
    except (OSError, ValueError, MemoryError, BadZipFile, AttributeError, zlib.error) as error:
        raise DataError(f"{path} is not a readable .npz archive ({error}).") from error


def _npy(path: Path) -> dict[str, Any]:
    """The one array of the file, under the file's name without its ending."""
    try:
        return {path.stem: np.load(path)}
    except _UNREADABLE as error:
        raise DataError(f"{path} is not a readable .npy array ({error}).") from error


def _mat(path: Path) -> dict[str, Any]:
    """Variables of a MATLAB file, those inside structures by a dotted name."""
    with path.open("rb") as stream:
        head = stream.read(520)
    try:
        # Version 7.3 is HDF5 behind a MATLAB header of 512 bytes, with the axes in reverse order.
        if _HDF5 in head:
            return _hdf5(path)
        _bounded(path)
        return dict(_flat(scipy.io.loadmat(path, simplify_cells=True)))
    except _UNREADABLE as error:
        raise DataError(f"{path} is not a readable .mat file ({error}).") from error


def _bounded(path: Path) -> None:
    """Refuses a file of version 5 whose packed variables are larger than the file may unpack to.

    Raises:
        DataError: they are.
    """
    data, position, allowed = path.read_bytes(), _MAT_HEADER, Allowance.of(path)
    while position + _MAT_TAG.size <= len(data):
        kind, length = _MAT_TAG.unpack_from(data, position)
        position += _MAT_TAG.size
        if kind == _COMPRESSED:
            unpacker, rest = zlib.decompressobj(), data[position : position + length]
            while rest and not unpacker.eof:
                allowed.take(len(unpacker.decompress(rest, _STEP)))
                rest = unpacker.unconsumed_tail
        position += length


def _hdf5(path: Path) -> dict[str, Any]:
    """Variables of a .mat file of version 7.3, which is HDF5."""
    try:
        import h5py
    except ImportError as error:
        raise DataError(
            f"{path} is a .mat file of version 7.3; reading it needs h5py: install it with"
            " pip install 'wam-ident[mat]', or save the file with -v7."
        ) from error

    allowed = Allowance.of(path)

    def datasets(group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
        for name, item in group.items():
            if isinstance(item, h5py.Dataset):
                if item.attrs.get("MATLAB_object_decode") == _OBJECT:
                    kind = np.asarray(item.attrs["MATLAB_class"]).astype(str)
                    told = f"{prefix}{name} (an object of class {kind}, which only MATLAB reads)"
                    yield told, np.array("")
                    continue
                allowed.take(item.size * item.dtype.itemsize)
                yield prefix + name, item[()].T
            elif not name.startswith("#") and isinstance(item, h5py.Group):
                yield from datasets(item, f"{prefix}{name}.")

    with h5py.File(path) as file:
        return dict(datasets(file))


def _flat(variables: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in variables.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        elif not name.startswith("__"):
            yield prefix + name, value


def _table(variables: dict[str, Any], wanted: Sequence[Name], path: Path) -> Table:
    columns: dict[Name, np.ndarray] = {}
    for name in wanted:
        if name in variables:
            values = np.squeeze(np.asarray(variables[str(name)]))
            if values.dtype.kind not in "fiubM":
                raise DataError(f"{path}: {name!r} does not hold numbers.")
            columns[name] = values if values.dtype.kind == "M" else values.astype(float)
    return Table(columns, tuple(variables))


def read_parquet(
    path: Path, wanted: Sequence[str | int]
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Wanted columns, vectors stacked to shape (S, n), and the names of all.

    Raises:
        DataError: no pyarrow, no Parquet file, or vectors of different lengths.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise DataError(
            f"{path} is a Parquet table; reading it needs pyarrow: install it with"
            " pip install 'wam-ident[parquet]', or save the table as CSV."
        ) from error
    try:
        with pq.ParquetFile(path) as file:
            names = tuple(file.schema_arrow.names)
            chosen = [name for name in names if name in wanted]
            parts = file.metadata
            groups = (parts.row_group(g) for g in range(parts.num_row_groups))
            Allowance.of(path).take(sum(group.total_byte_size for group in groups))
            table = file.read(columns=chosen)
    except (OSError, pa.ArrowException) as error:
        raise DataError(f"{path} is not a readable Parquet table ({error}).") from error
    return {name: _numbers(path, name, table.column(name)) for name in chosen}, names


def _numbers(path: Path, name: str, column: Any) -> np.ndarray:
    import pyarrow.types as types

    if not (types.is_list(column.type) or types.is_large_list(column.type)
            or types.is_fixed_size_list(column.type)):  # fmt: skip
        return np.asarray(column.to_numpy())
    rows = [np.zeros(0) if row is None else np.asarray(row) for row in column.to_pylist()]
    widths = sorted({len(row) for row in rows})
    if len(widths) > 1:
        raise DataError(f"{path}: the vectors of {name!r} have lengths {widths}, not one.")
    return np.array(rows)
