"""The stamps of a log from the time column of a table, or why that column is no clock."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.errors import DataError

_NS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0}
_LATEST_S = 2**31
_BACK_NS = 0.5e9
"""Stamps may come in another order than their rows; a longer way back, or one of half the whole
time, is another recording or no clock."""
_LEAST_SHARED = 2.0
"""Rows with one stamp, in the middle of all groups, from which on stamps count as rounded."""
_ALIKE = 0.8
"""Of those groups, that have to be of nearly one size."""
_OWN_CLOCK = "`time: {rate_hz: ...}`, where rows were taken evenly"


def stamps(source: Path, column: np.ndarray, unit: str, position: np.ndarray) -> NDArray[np.int64]:
    """Stamps of a log [ns]; where times count from a trigger, they begin at the first one.

    Args:
        source: the table.
        column: its times, shape (S,): numbers, or dates.
        unit: that of the numbers.
        position: the same rows of the joints' positions, shape (S, n).

    Raises:
        DataError: the column is no clock, or one that is rounded to several rows.
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
    for fault in (_standing(ns), _back(ns), _rounded(ns, position)):
        if fault:
            raise DataError(f"{source}: the time column {fault}.")
    return ns.astype(np.int64)


def _standing(ns: np.ndarray) -> str | None:
    if len(ns) < 2 or ns.max() > ns.min():
        return None
    return (
        f"holds {ns[0] * 1e-9:g} s in all {len(ns)} rows: name the column that holds the time, or"
        f" write {_OWN_CLOCK}"
    )


def _back(ns: np.ndarray) -> str | None:
    """Where the times fall far below those before."""
    below = np.maximum.accumulate(ns) - ns
    back = np.flatnonzero(below > min(_BACK_NS, 0.5 * (ns.max() - ns.min())))
    if not len(back):
        return None
    row, top = back[0], int(np.argmax(ns[: back[0]]))
    before, after = f"{ns[top] * 1e-9:g} s", f"{ns[row] * 1e-9:g} s"
    if top == row - 1:
        return (
            f"goes back from {before} to {after} after {row} rows; if these are several"
            " recordings, choose one with rows.column and rows.equal, or with rows.first and"
            " rows.last"
        )
    return (
        f"goes back bit by bit, from {before} to {after} after {top + 1} to {row} rows: name the"
        f" column that holds the time, or write {_OWN_CLOCK}"
    )


def _rounded(ns: np.ndarray, position: np.ndarray) -> str | None:
    """To what the times are rounded, where nearly as many rows, more than one, share each.

    Rows that repeat the reading before are not meant: their time is known.
    """
    shared = np.diff(ns) == 0
    first = np.flatnonzero(np.concatenate([[True], ~shared]))
    sizes = np.diff(first)[1:]  # without the first and the last group, which may be cut
    if len(sizes) < 3 or (typical := float(np.median(sizes))) < _LEAST_SHARED:
        return None
    if (np.abs(sizes - typical) <= max(1.0, 0.25 * typical)).mean() < _ALIKE:
        return None
    moved = (np.diff(position, axis=0) != 0).any(axis=1)
    if moved[shared].mean() < 0.5 * moved[~shared].mean():
        return None
    step_s = float(np.median(np.diff(ns[first]))) * 1e-9
    rate_hz = sizes.sum() / (ns[first[-1]] - ns[first[1]]) * 1e9
    return (
        f"is rounded to about {step_s:.3g} s, so that about {typical:g} rows share each stamp:"
        f" where rows were taken evenly, write `time: {{rate_hz: {rate_hz:.4g}}}` in its place, or"
        " save the table with more digits of the time"
    )
