"""Torque of a slower source that was held until its next reading came, while positions went on.

The torque of all joints is then new at the same rows and stays in those between, at even distances.
Torque in coarse steps stays as well, but each joint's changes at rows of its own; and an arm that
stands still keeps its torque for a while, but not again and again for equally long.
"""

from collections.abc import Sequence

import numpy as np

from ident.checks.remark import Grade, Remark
from ident.recordings.dataset import Dataset
from ident.recordings.samples import read_samples
from ident.signals.arrays import Array

_TOGETHER = 0.8
"""Of the rows at which any joint's torque is new, those at which the middle joint's is: two joints
that change by themselves as rarely come to 0.65, more of them to less."""

_EVEN = 0.9
"""Of the rows, those in distances that are the usual one, or one row more or less."""

_LEAST_READINGS = 16

_MOST_ROWS = 20_000
"""That are looked at: a recorder that holds torque does so from its start."""


def held_torque(data: Dataset, names: Sequence[str]) -> list[Remark]:
    """What is said of measured torque that stands in several rows at all joints alike.

    Args:
        data: the recording.
        names: of the joints.
    """
    if data.torque != "measured" or data.moving.sum() < 2:
        return []
    columns = [data.source.joint_names.index(name) for name in names]
    parts: list[Array] = []
    for samples in read_samples(data.source, data.torque, columns):
        parts.append(samples.tau[:, data.moving])
        if sum(map(len, parts)) >= _MOST_ROWS:
            break
    rows = _rows_each(np.concatenate(parts))
    if rows is None:
        return []
    text = (
        f"{data.name}: each reading of the torque stands in about {rows:.2g} rows, at all joints"
        f" alike: torque was recorded at about {data.rate_hz / rows:.3g} Hz and held, positions at"
        f" {data.rate_hz:.3g} Hz. It is {(rows - 1) / (2 * data.rate_hz):.2g} s late in the mean."
    )
    advice = (
        "Record the torque at the rate of the positions, or import only the rows at which the"
        " torque is new."
    )
    return [Remark("low_rate", (), text, Grade.DOUBTFUL, advice)]


def _rows_each(tau: Array) -> float | None:
    """In how many rows each reading of the torque, shape (S, m), stands; None: in one."""
    changed = np.diff(tau, axis=0) != 0
    new = np.flatnonzero(changed.any(axis=1))
    if len(new) < _LEAST_READINGS or np.median(changed[new].mean(axis=0)) < _TOGETHER:
        return None
    steps = np.diff(new)
    usual = float(np.median(steps))
    even = steps[np.abs(steps - usual) <= 1]
    if usual < 2 or even.sum() < _EVEN * len(changed):
        return None
    return float(even.mean())
