"""Residuals of the current model, row by row, and their autocorrelation."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.blocks import EXCLUDED
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.model_columns import joint_columns
from ident.gap.regression.weighted_fit import Fit
from ident.signals.arrays import Array

_NEGLIGIBLE = 0.05  # autocorrelation at which the sum over lags ends


@dataclass(frozen=True)
class Residual:
    """Residuals of one joint, rows in order of time, block by block.

    Attributes:
        values: [N m], shape (R,).
        region: of each row, shape (R,).
        block: number of the block of time of each row, shape (R,).
        excluded: rows that no fit uses, shape (R,).
    """

    values: Array
    region: NDArray[np.int64]
    block: NDArray[np.int64]
    excluded: NDArray[np.bool_]


def residuals(design: DesignMatrix, model: Fit) -> list[Residual]:
    """Residuals of each joint on all rows; held joints have none."""
    found = []
    for j, c in enumerate(joint_columns(design.equations, model.structure)):
        columns = design.columns[j]
        values = columns[:, -1] - c.of(columns) @ model.x[c.unknown]
        rows = slice(len(columns))
        excluded = design.fold[rows] == EXCLUDED
        found.append(Residual(values, design.region[rows, j], design.block[rows], excluded))
    return found


def autocorrelation_length(values: Array, block: NDArray[np.int64]) -> float:
    """Rows that count as one independent row: 1 + 2 times the sum of the autocorrelation.

    Args:
        values: residual, rows in order of time, shape (R,).
        block: of each row; rows of different blocks are not neighbours, shape (R,).
    """
    total, lag = 0.0, 1
    while lag < len(values) // 8:
        same = block[lag:] == block[:-lag]
        here, there = values[lag:][same], values[:-lag][same]
        size = float(np.sqrt((here @ here) * (there @ there)))
        rho = float(here @ there) / size if size > 0.0 else 0.0
        if rho < _NEGLIGIBLE:
            break
        total += rho
        lag += 1
    return 1.0 + 2.0 * total
