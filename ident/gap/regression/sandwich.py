"""Cluster-robust (sandwich) variances: scores summed over blocks of time (Liang and Zeger 1986)."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.rows import WindowedRows
from ident.signals.arrays import Array


def block_labels(
    rows: WindowedRows, design: DesignMatrix, block_s: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number of the block of time that each row lies in, shape (R,), and of its first pass.

    The first pass is the row at which the arm was there in the same motion for the first time.

    Args:
        rows: the rows.
        design: with their times.
        block_s: length of a block [s].
    """
    start = design.t[np.searchsorted(rows.blocks.number, rows.blocks.number)]
    within = np.floor((rows.hop_s + design.t - start) / block_s).astype(int)
    numbers = rows.blocks.number * (within.max() + 1) + within
    block = np.unique(numbers, return_inverse=True)[1]
    return block, block if rows.first_pass is None else block[rows.first_pass]


def block_sums(values: Array, label: NDArray[np.int64], count: int) -> Array:
    """Sums of rows, shape (R, k), over the blocks of some number that they lie in, (count, k)."""
    rows = np.arange(len(label))
    return csr_matrix((np.ones(len(label)), (label, rows)), shape=(count, len(label))) @ values


def sandwich(scores: Array, inverse: Array, freedom: float) -> Array:
    """Variances of some unknowns, shape (k,).

    Args:
        scores: of independent blocks, shape (B, p).
        inverse: rows of the inverse of the normal matrix, shape (k, p).
        freedom: blocks' worth of degrees of freedom that the fit uses.
    """
    count = int(scores.any(axis=1).sum())
    inflation = count / max(count - freedom, 1.0)
    return inflation * np.sum((scores @ inverse.T) ** 2, axis=0)
