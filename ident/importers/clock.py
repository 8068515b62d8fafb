"""The stamps of a log from the time column of a table, or why that column is no clock."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.errors import DataError

_NS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0}
_LATEST_S = 2**31
_BACK_NS = 0.5e9
"""Stamps may come in another order than their rows; a longer way back is another recording."""


def stamps(source: Path, column: np.ndarray, unit: str) -> NDArray[np.int64]:
    """Stamps of a log [ns]; where times count from a trigger, they begin at the first one.

    Args:
        source: the table.
        column: its times, shape (S,): numbers, or dates.
        unit: that of the numbers.

    Raises:
        DataError: the column is no clock.
    """
    if column.dtype.kind == "M":
        ns = column.astype("datetime64[ns]").astype(np.int64)
    else:
        ns = np.rint(column * _NS[unit])
    if ns.max() >= _LATEST_S * 1e9:
        raise DataError(
            f"{source}: the time column runs to {ns.max() * 1e-9:g} s; a log holds 0 s to"
            f" {_LATEST_S} s."
        )
    ns = ns - min(ns.min(), 0)
    back = np.flatnonzero(np.diff(ns) < -_BACK_NS)
    if len(back):
        before, after = ns[back[0] : back[0] + 2] * 1e-9
        raise DataError(
            f"{source}: the time column goes back from {before:g} s to {after:g} s after"
            f" {back[0] + 1} rows; if these are several recordings, choose one with rows.column"
            " and rows.equal, or with rows.first and rows.last."
        )
    return ns.astype(np.int64)
