"""Single rows of a recording, evenly thinned."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ident.regression.rows import Rows
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Subsample:
    """Single rows, evenly thinned: for figures, and for what no triangle can tell.

    Attributes:
        t: time since the recording's first sample [s], shape (E,).
        speed: velocity [rad/s], shape (E, n); zero for held joints.
        kept: which rows entered the fit, shape (E, n).
        W: regressor, shape (E, n, b); zero for held joints.
        tau: torque [N m], shape (E, n).
        tau_rate: its derivative [N m/s], shape (E, n).
        curves: Coulomb friction along the curves that may be chosen, shape (E, n, T).
    """

    t: Array
    speed: Array
    kept: NDArray[np.bool_]
    W: Array
    tau: Array
    tau_rate: Array
    curves: Array

    def rows(self, *more: Array) -> list[Array]:
        """Per joint the rows [more | W | tau] that entered the fit; empty for held joints.

        Args:
            more: further columns, each of shape (E, n).
        """
        return [
            np.column_stack([*(m[k, j] for m in more), self.W[k, j], self.tau[k, j]])
            for j, k in enumerate(self.kept.T)
        ]


def subsample(
    rows: Rows, kept: NDArray[np.bool_], stride: int, joints: NDArray[np.intp], n: int
) -> Subsample:
    """Every so-manieth row.

    Args:
        rows: of the moving joints.
        kept: which rows enter the fit, shape (R, m).
        stride: one row is taken of so many.
        joints: the moving ones, from 0, shape (m,).
        n: number of all joints.
    """

    def of_all_joints(values: NDArray) -> NDArray:
        part = values[::stride]
        result = np.zeros((len(part), n, *values.shape[2:]), dtype=values.dtype)
        result[:, joints] = part
        return result

    return Subsample(
        t=rows.t[::stride],
        speed=of_all_joints(rows.speed),
        kept=of_all_joints(kept),
        W=of_all_joints(rows.W),
        tau=of_all_joints(rows.tau),
        tau_rate=of_all_joints(rows.tau_rate),
        curves=of_all_joints(rows.curves),
    )


def thinned(e: Subsample) -> Subsample:
    """Every other row; a copy, since a view would keep all of them."""
    return Subsample(*(getattr(e, f.name)[::2].copy() for f in fields(e)))


def joined(parts: list[Subsample]) -> Subsample:
    """The rows of several, one after the other."""
    names = [f.name for f in fields(Subsample)]
    return Subsample(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))
