"""Inner products of all columns, joint by joint, from which every fit of the search is made."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.signals.arrays import Array


@dataclass(frozen=True)
class Layout:
    """Order of a joint's columns: base, viscous, reversal curves, effects, torque.

    Attributes:
        base: numbers of the base inertial parameters that the joint feels, shape (b,).
        reversals: number of reversal curves.
        effects: number of columns of accepted effects and candidates.
    """

    base: NDArray[np.int64]
    reversals: int
    effects: int

    @property
    def viscous(self) -> int:
        """Column of the viscous friction."""
        return len(self.base)

    @property
    def first_reversal(self) -> int:
        """Column of the first reversal curve."""
        return len(self.base) + 1

    @property
    def first_effect(self) -> int:
        """First column of an effect."""
        return self.first_reversal + self.reversals

    @property
    def torque(self) -> int:
        """Column of the torque, the last one."""
        return self.first_effect + self.effects


@dataclass(frozen=True)
class NormalEquations:
    """Inner products per joint, fold and noise region.

    Attributes:
        base: number of base inertial parameters b.
        layouts: per joint.
        products: per joint, shape (folds, regions, p, p).
        counts: rows per joint, fold and region, shape (n, folds, regions).
        reference_error: error of a reference model [N m], shape (n,), or None.
    """

    base: int
    layouts: tuple[Layout, ...]
    products: tuple[Array, ...]
    counts: NDArray[np.int64]
    reference_error: Array | None = None

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.layouts)

    def of(self, folds: Sequence[int]) -> "NormalEquations":
        """The sum over some folds, as one fold."""
        chosen = list(folds)
        return NormalEquations(
            self.base,
            self.layouts,
            tuple(p[chosen].sum(axis=0, keepdims=True) for p in self.products),
            self.counts[:, chosen].sum(axis=1, keepdims=True),
            self.reference_error,
        )


def joint_products(
    columns: Array,
    fold: NDArray[np.int64],
    region: NDArray[np.int64],
    shape: tuple[int, int],
    candidates: Sequence[tuple[int, int]] = (),
) -> tuple[Array, NDArray[np.int64]]:
    """Inner products of one joint's columns, and numbers of rows, by fold and region.

    Products of two different candidates stay zero, since no fit has both.

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
