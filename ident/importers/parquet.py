"""Parquet tables, as learning frameworks keep them: a column of numbers, or of vectors, by name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.bounds import Allowance


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
