"""A torque sensor whose range ends too early, or that measures about another zero.

A torque beyond the range is recorded as the range's end: the same value again and again while the
joint moves, though the arm, as it is at the other instants, needs more. (Where a motor gives no
more, the recorded torque is right, and needs nothing beyond.) Where most of it is at its ends,
little is left to tell what the arm needs, but what a motor gave is explained, however often the
same, and clipped torque is not. A zero that is off by more than the joint's torque ever comes to is
no friction, spring or weight that an arm carries.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.checks.settings import CheckSettings
from ident.checks.torque import steps_coarsely
from ident.regression.probe import Chunk
from ident.regression.probe_fit import gram, held_out_residual, shares, solution, weights_of
from ident.signals.arrays import Array

_MOSTLY = 0.5
"""Of a joint's motion: where its torque is at its end more often, the rest alone tells too little,
and friction that changes its sign may stand there as well."""

_EXPLAINED = 0.1
"""Error of such a joint beside what its torque varies by, below which a motor gave it: friction
that stands at two values leaves 0.02, clipped torque 0.19 and more."""

_PILED = 5.0
"""Times as often as the value beside it is recorded, what lies beyond is: a torque in coarse steps
stays at its last one no longer than at others."""

_IN_A_ROW = 3
"""Equal samples, from which a torque stays where it is."""


def clipped_torque(case: Case, chunks: Sequence[Chunk], bounds: CheckSettings) -> list[Remark]:
    """What is said of joints whose recorded torque ends at a value that the arm goes beyond."""
    at_end = np.zeros_like(case.probe.raw, dtype=bool)
    for k in np.flatnonzero(case.probe.moving).tolist():
        for end in _ends([c.tau[:, k] for c in chunks], bounds):
            at_end[:, k] |= case.probe.raw[:, k] == end
    at_end &= case.probe.counted
    if not at_end.any():
        return []
    part = at_end.sum(axis=0) / np.maximum(case.probe.counted.sum(axis=0), 1)
    needed = _beyond(case, at_end) > bounds.clipped_beyond
    places = np.flatnonzero(needed & ((part < _MOSTLY) | (_left(case) > _EXPLAINED))).tolist()
    if not places:
        return []
    most = np.abs(case.probe.raw * at_end).max(axis=0)
    ends = joined(
        [
            f"{_torque(case, k, most[k])} at {_joint(case, k)}, for {100 * part[k]:.0f} % of its"
            " motion"
            for k in places
        ]
    )
    text = (
        f"The recorded torque stays at one and the same largest value ({ends}) while the arm needs"
        " more there: it is clipped."
    )
    advice = "Record it over the whole range of the motion's torque, or move more gently."
    return [Remark("torque_range", numbers(places), text, Grade.DOUBTFUL, advice)]


def _ends(courses: Sequence[Array], bounds: CheckSettings) -> list[float]:
    """Least and largest value of a joint's torque, where it stays there for long."""
    values, counts = np.unique(np.concatenate(courses), return_counts=True)
    between = counts[1:-1]
    few = between.sum() < _IN_A_ROW * len(between)  # each about once: few values, no coarse steps
    if len(values) < 2 or (steps_coarsely(courses) and not few):
        return []
    if _switches(courses, values[0], values[-1]):
        return []
    least = bounds.clipped_share * counts.sum()
    piled = ((0, 1), (-1, -2))  # an end, and the value beside it
    ends = [float(values[e]) for e, n in piled if counts[e] > _PILED * counts[n]]
    return [e for e in ends if sum(_staying(c == e) for c in courses) > least]


def _switches(courses: Sequence[Array], low: float, high: float) -> bool:
    """Whether a torque that leaves one end is mostly at the other at once: so drives switch."""
    left = across = 0
    for c in courses:
        before, after = c[:-1], c[1:]
        left += int((np.isin(before, (low, high)) & (before != after)).sum())
        across += int((np.abs(after - before) == high - low).sum())
    return 2 * across > left


def _torque(case: Case, k: int, value: float) -> str:
    return f"{value:.3g} {'N' if case.robot.sliding[k] else 'N m'}"


def _joint(case: Case, k: int) -> str:
    return joints([k], case.robot.joint_names)


def _staying(at_end: NDArray[np.bool_]) -> int:
    """Samples in runs of at least so many."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], at_end.astype(int), [0]])))
    runs = edges[1::2] - edges[::2]
    return int(runs[runs >= _IN_A_ROW].sum())


def _beyond(case: Case, at_end: NDArray[np.bool_]) -> Array:
    """By how much the arm needs more where a torque ends, beside the usual error, shape (n,)."""
    c = case.columns
    inside = ~at_end
    w = weights_of(c.tau)
    A, y = gram(c.W * (inside * w)[:, :, None], c.tau * inside * w)
    needed = c.W @ solution(A, y)
    error = np.sqrt(np.sum(inside * (c.tau - needed) ** 2, axis=0) / np.maximum(inside.sum(0), 1))
    more = (np.abs(needed) - np.abs(c.tau)) * np.where(needed * c.tau > 0, 1.0, -1.0)
    mean = np.sum(at_end * more, axis=0) / np.maximum(at_end.sum(axis=0), 1)
    return np.divide(mean, error, out=np.zeros_like(mean), where=error > 0)


def _left(case: Case) -> Array:
    """What a fit of all torque leaves of each joint's, beside what that varies by, shape (n,)."""
    tau, used = case.columns.tau, case.probe.counted  # zero where the joint stands
    count = np.maximum(used.sum(axis=0), 1)
    square = np.sum(tau**2, axis=0) / count
    spread = np.sqrt(np.maximum(square - (np.sum(tau, axis=0) / count) ** 2, 0.0))
    left = case.by_joint * np.sqrt(square)
    return np.divide(left, spread, out=np.zeros_like(left), where=spread > 0)


def shifted_torque_zero(case: Case, bounds: CheckSettings) -> list[Remark]:
    """What is said of joints whose torque has an offset larger than all the rest of it."""
    c, n = case.columns, case.robot.dof
    first = int(c.friction[0, 0]) + 2 * n
    w = weights_of(c.tau)
    A, y = gram(c.W * w[:, None], c.tau * w)
    offset = solution(A, y)[first : first + n]
    rest = np.abs(case.probe.tau - offset).max(axis=0)
    places = [
        k
        for k in np.flatnonzero(np.abs(offset) > bounds.offset_share * rest).tolist()
        if case.probe.moving[k] and _needed(case, k, first + k, bounds)
    ]
    if not places:
        return []
    told = joined(
        [
            f"{_torque(case, k, offset[k])} at {_joint(case, k)}, where all the rest of it comes to"
            f" {_torque(case, k, rest[k])} at most"
            for k in places
        ]
    )
    text = f"The torque appears to be measured about a zero that is far off: a constant {told}."
    advice = "Set the torque sensor to zero with the joint unloaded, and check its sign and unit."
    return [Remark("torque_range", numbers(places), text, Grade.DOUBTFUL, advice)]


def _needed(case: Case, k: int, place: int, bounds: CheckSettings) -> bool:
    """Whether the arm's weight cannot stand in for a joint's offset, as at a vertical slide."""
    W = case.columns.W.copy()
    W[:, :, place] = 0.0
    without = shares(held_out_residual(replace(case.columns, W=W)), case.columns.tau)[k]
    return bool(without > bounds.offset_needed * case.by_joint[k])
