"""Inner products of all columns, joint by joint, from which every fit of the gap is made."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Layout:
    """Where a joint's columns stand.

    Attributes:
        base: places of the base inertial parameters, shape (b,): column by global number.
        turnings: number of reversal shapes.
        extra: number of candidate columns.

    The order is: base, viscous, reversal shapes, candidates, torque.
    """

    base: NDArray[np.int64]
    turnings: int
    extra: int

    @property
    def viscous(self) -> int:
        """Column of the viscous friction."""
        return len(self.base)

    @property
    def first_turning(self) -> int:
        """Column of the first reversal shape."""
        return len(self.base) + 1

    @property
    def first_extra(self) -> int:
        """First candidate column."""
        return self.first_turning + self.turnings

    @property
    def torque(self) -> int:
        """Column of the torque, the last one."""
        return self.first_extra + self.extra


@dataclass(frozen=True)
class Grams:
    """Inner products per joint, fold and region.

    Attributes:
        base: number of base inertial parameters b.
        layouts: per joint.
        products: per joint, shape (folds, regions, p, p).
        counts: rows per joint, fold and region, shape (n, folds, regions).
        least: error that a trusted model brings [N m], shape (n,), or None.
    """

    base: int
    layouts: tuple[Layout, ...]
    products: tuple[Array, ...]
    counts: NDArray[np.int64]
    least: Array | None = None

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.layouts)

    def of(self, folds: Sequence[int]) -> "Grams":
        """The same of some folds, taken together as one."""
        chosen = list(folds)
        return Grams(
            self.base,
            self.layouts,
            tuple(p[chosen].sum(axis=0, keepdims=True) for p in self.products),
            self.counts[:, chosen].sum(axis=1, keepdims=True),
            self.least,
        )


def joint_products(
    columns: Array, fold: NDArray[np.int64], region: NDArray[np.int64], shape: tuple[int, int]
) -> tuple[Array, NDArray[np.int64]]:
    """Inner products of one joint's columns, and numbers of rows, by fold and region.

    Args:
        columns: shape (R, p).
        fold: of each row, shape (R,).
        region: of each row, shape (R,).
        shape: number of folds, number of regions.
    """
    p = columns.shape[1]
    products, counts = np.zeros((*shape, p, p)), np.zeros(shape, dtype=np.int64)
    for f in range(shape[0]):
        for r in range(shape[1]):
            rows = columns[(fold == f) & (region == r)]
            products[f, r] = rows.T @ rows
            counts[f, r] = len(rows)
    return products, counts
