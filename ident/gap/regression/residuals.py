"""What the model so far leaves, row by row."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.regression.design_matrix import EXCLUDED, Table
from ident.gap.regression.weighted_fit import Fit, places

Array = NDArray[np.floating]

_FORGOTTEN = 0.05  # correlation below which the sum ends


@dataclass(frozen=True)
class Residual:
    """Residuals of one joint, rows in order of time, segment by segment.

    Attributes:
        values: [N m], shape (R,).
        region: of each row, shape (R,).
        segment: of each row, shape (R,).
        apart: which rows no fit has seen, shape (R,).
    """

    values: Array
    region: NDArray[np.int64]
    segment: NDArray[np.int64]
    apart: NDArray[np.bool_]


def residuals(table: Table, model: Fit) -> list[Residual]:
    """Residuals of each joint on all rows; held joints have none."""
    found = []
    for j, pl in enumerate(places(table.grams, model.choice)):
        columns = table.columns[j]
        values = columns[:, -1] - pl.of(columns) @ model.x[pl.unknown]
        rows = slice(None) if len(columns) else slice(0)
        apart = table.fold[rows] == EXCLUDED
        found.append(Residual(values, table.region[rows, j], table.segment[rows], apart))
    return found


def memory_of(values: Array, segment: NDArray[np.int64]) -> float:
    """Rows that count as one: 1 + 2 sum of the autocorrelation.

    Args:
        values: residual, rows in order of time, shape (R,).
        segment: of each row; neighbours of different segments do not count as such, shape (R,).
    """
    total, lag = 0.0, 1
    while lag < len(values) // 8:
        same = segment[lag:] == segment[:-lag]
        here, there = values[lag:][same], values[:-lag][same]
        size = float(np.sqrt((here @ here) * (there @ there)))
        rho = float(here @ there) / size if size > 0.0 else 0.0
        if rho < _FORGOTTEN:
            break
        total += rho
        lag += 1
    return 1.0 + 2.0 * total
