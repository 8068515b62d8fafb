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
        turnings: number of reversal curves.
        extra: number of candidate columns.

    The order is: base, viscous, reversal curves, candidates, torque.
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
        """Column of the first reversal curve."""
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
class NormalEquations:
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

    def of(self, folds: Sequence[int]) -> "NormalEquations":
        """The same of some folds, taken together as one."""
        chosen = list(folds)
        return NormalEquations(
            self.base,
            self.layouts,
            tuple(p[chosen].sum(axis=0, keepdims=True) for p in self.products),
            self.counts[:, chosen].sum(axis=1, keepdims=True),
            self.least,
        )


def joint_products(
    columns: Array,
    fold: NDArray[np.int64],
    region: NDArray[np.int64],
    shape: tuple[int, int],
    candidates: Sequence[tuple[int, int]] = (),
) -> tuple[Array, NDArray[np.int64]]:
    """Inner products of one joint's columns, and numbers of rows, by fold and region.

    Those of two different candidates are left at zero: no fit has both.

    Args:
        columns: shape (R, p).
        fold: of each row, shape (R,).
        region: of each row, shape (R,).
        shape: number of folds, number of regions.
        candidates: first column and number of columns of each candidate.
    """
    p = columns.shape[1]
    own = _by_width(candidates)
    always = np.ones(p, dtype=bool)
    for where in own:
        always[where] = False
    model = np.flatnonzero(always)
    products, counts = np.zeros((*shape, p, p)), np.zeros(shape, dtype=np.int64)
    for f in range(shape[0]):
        for r in range(shape[1]):
            rows = columns[(fold == f) & (region == r)]
            here = products[f, r]
            here[model] = rows[:, model].T @ rows
            here[:, model] = here[model].T
            for where in own:
                mine = rows[:, where]
                here[where[:, :, None], where[:, None, :]] = np.einsum("rsk,rsl->skl", mine, mine)
            counts[f, r] = len(rows)
    return products, counts


def _by_width(candidates: Sequence[tuple[int, int]]) -> list[NDArray[np.int64]]:
    """Columns of the candidates of each width, shape (S, width)."""
    starts: dict[int, list[int]] = {}
    for start, width in candidates:
        starts.setdefault(width, []).append(start)
    return [np.array(s)[:, None] + np.arange(width) for width, s in starts.items()]
