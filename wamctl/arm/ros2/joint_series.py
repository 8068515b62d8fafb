"""Joint messages as arrays over time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.errors import DataError

Array = NDArray[np.floating]
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


def columns_of(series: JointSeries, joints: tuple[str, ...]) -> JointSeries:
    """The series of these joints, in this order."""
    if joints == series.joint_names:
        return series
    index = [series.joint_names.index(j) for j in joints]
    q, qd, effort = (
        None if a is None else a[:, index] for a in (series.q, series.qd, series.effort)
    )
    return JointSeries(joints, series.stamp_ns, q, qd, effort)


def joined(blocks: list[JointSeries], where: str) -> JointSeries:
    """One series of several with the same joints.

    Args:
        blocks: in the order of time.
        where: what to call them in messages.

    Raises:
        DataError: numbers that are not finite, or missing in some of the blocks.
    """
    stamps = np.concatenate([b.stamp_ns for b in blocks])
    columns = []
    for what, arrays in (
        ("positions", [b.q for b in blocks]),
        ("velocities", [b.qd for b in blocks]),
        ("efforts", [b.effort for b in blocks]),
    ):
        present = [a for a in arrays if a is not None]
        if present and len(present) < len(arrays):
            first = next(b for b, a in zip(blocks, arrays, strict=True) if a is None)
            raise DataError(
                f"{where} carries {what} in {sum(map(len, present))} of {len(stamps)} messages,"
                f" and none from {first.stamp_ns[0]} ns on: cut the recording there."
            )
        column = np.concatenate(present) if present else None
        columns.append(_finite(column, blocks[0].joint_names, stamps, f"{where}: {what}"))
    return JointSeries(blocks[0].joint_names, stamps, *columns)


def _finite(
    column: Array | None, joints: tuple[str, ...], stamps: Stamps, what: str
) -> Array | None:
    """The column; None where a driver fills it with NaN because it has no such measurement."""
    if column is None or np.isfinite(column).all():
        return column
    bad = ~np.isfinite(column)
    if bad.all():
        return None
    sample, joint = np.argwhere(bad)[0]
    raise DataError(
        f"{what} of {joints[joint]} are not finite in {bad[:, joint].sum()} of {len(stamps)}"
        f" messages, the first at {stamps[sample]} ns."
    )
