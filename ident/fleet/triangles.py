"""The triangles of a log as bytes: per joint the columns in use and the upper triangle."""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.signals.arrays import Array

_HEAD = struct.Struct("<HH")  # joint, columns in use
_SIZES = struct.Struct("<HH")  # joints stored, columns in all


@dataclass(frozen=True)
class JointTriangle:
    """The rows of one joint, reduced.

    Attributes:
        joint: from 0.
        used: places of its columns among the p + 1 of [X | tau], shape (c,), ascending.
        R: upper triangle with R^T R = rows^T rows, shape (c, c).
    """

    joint: int
    used: NDArray[np.int64]
    R: Array


def of_rows(joint: int, triangle: Array) -> JointTriangle:
    """The triangle without its columns of zeros; every row of R is given a positive diagonal.

    Args:
        joint: from 0.
        triangle: shape (p + 1, p + 1), triangular in the columns that are not zero.
    """
    used = np.flatnonzero(np.any(triangle != 0.0, axis=0))
    R = triangle[: len(used), used]
    return JointTriangle(joint, used, R * np.where(np.diag(R) < 0.0, -1.0, 1.0)[:, None])


def packed(triangles: list[JointTriangle], columns: int) -> bytes:
    """The triangles as bytes, little-endian float64.

    Args:
        triangles: of one log.
        columns: number p + 1 of all columns.
    """
    parts = [_SIZES.pack(len(triangles), columns)]
    for t in triangles:
        upper = np.triu_indices(len(t.used))
        parts += [
            _HEAD.pack(t.joint, len(t.used)),
            t.used.astype("<u2").tobytes(),
            t.R[upper].astype("<f8").tobytes(),
        ]
    return b"".join(parts)


def unpacked(blob: bytes) -> tuple[list[JointTriangle], int]:
    """The triangles of `packed`, and the number of all columns."""
    count, columns = _SIZES.unpack_from(blob)
    at, found = _SIZES.size, []
    for _ in range(count):
        joint, c = _HEAD.unpack_from(blob, at)
        at += _HEAD.size
        used = np.frombuffer(blob, "<u2", c, at).astype(np.int64)
        at += 2 * c
        R = np.zeros((c, c))
        R[np.triu_indices(c)] = np.frombuffer(blob, "<f8", c * (c + 1) // 2, at)
        at += 8 * (c * (c + 1) // 2)
        found.append(JointTriangle(joint, used, R))
    return found, columns
