"""Joint messages as arrays over time."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.arrays import Array

Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class JointSeries:
    """Joint messages as arrays: S samples of n joints.

    Attributes:
        joint_names: the n joints, in the order of the columns.
        stamp_ns: instants as they stand in the headers [ns], shape (S,); they may be irregular.
        q: position [rad], shape (S, n), or None.
        qd: velocity [rad/s], shape (S, n), or None.
        effort: joint torque [N m], shape (S, n), or None.
    """

    joint_names: tuple[str, ...]
    stamp_ns: Stamps
    q: Array | None
    qd: Array | None
    effort: Array | None

    @property
    def positions(self) -> Array:
        """The positions of a series that has them, shape (S, n).

        Raises:
            ValueError: it has none.
        """
        if self.q is None:
            raise ValueError("a series without positions")
        return self.q


@dataclass(frozen=True)
class ReferenceSeries:
    """The motion that was wanted: R samples of n joints.

    Attributes:
        stamp_ns: instants of recording [ns], shape (R,).
        q: position [rad], shape (R, n).
        qd: velocity [rad/s], shape (R, n).
        qdd: acceleration [rad/s^2], shape (R, n).
    """

    stamp_ns: Stamps
    q: Array
    qd: Array
    qdd: Array


Series = TypeVar("Series", JointSeries, ReferenceSeries)


def rows_of(series: Series, places: NDArray[np.bool_]) -> Series:
    """Some of the messages of a series, shape (S,)."""
    arrays = {
        f.name: value[places]
        for f in fields(series)
        if isinstance(value := getattr(series, f.name), np.ndarray)
    }
    return replace(series, **arrays)


def columns_of(series: JointSeries, joints: tuple[str, ...]) -> JointSeries:
    """The series of these joints, in this order."""
    if joints == series.joint_names:
        return series
    index = [series.joint_names.index(j) for j in joints]
    q, qd, effort = (
        None if a is None else a[:, index] for a in (series.q, series.qd, series.effort)
    )
    return JointSeries(joints, series.stamp_ns, q, qd, effort)


def joined(blocks: Sequence[JointSeries]) -> JointSeries:
    """One series of several with the same joints and the same columns, in the order of time."""
    q, qd, effort = (
        None if any(c is None for c in columns) else np.concatenate(columns)
        for columns in zip(*((b.q, b.qd, b.effort) for b in blocks), strict=True)
    )
    stamps = np.concatenate([b.stamp_ns for b in blocks])
    return JointSeries(blocks[0].joint_names, stamps, q, qd, effort)
