"""Recordings as uniform samples of position and torque, joints in the robot's order."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ident.errors import JointMismatchError
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording

Array = NDArray[np.floating]
TorqueSource = Literal["commanded", "measured"]

_JITTER = 0.02
"""Stamps that stray less than this part of a period count as uniform."""

_GAP_PERIODS = 10
"""A hole of more periods than this is never bridged."""

_HELD = 0.05
"""A joint that spans less than this [rad or m] is held, and its place is not known any better."""


@dataclass(frozen=True)
class Segment:
    """An unbroken stretch of uniform samples.

    Attributes:
        start_s: time of its first sample since the recording's first [s].
        q: position [rad], shape (S, n).
        tau: joint torque [N m], shape (S, n).
        reference: the wanted position [rad], shape (S, n), or None.
        used: first and end of the samples that rows are wanted of; the others only feed the filter.
            None: all.
    """

    start_s: float
    q: Array
    tau: Array
    reference: Array | None = None
    used: tuple[int, int] | None = None

    @property
    def span(self) -> range:
        """Places of the used samples."""
        return range(*(self.used or (0, len(self.q))))


@dataclass(frozen=True)
class Dataset:
    """One recording, ready for the filter.

    Attributes:
        name: the log's name.
        rate_hz: of the samples.
        segments: unbroken stretches, in order of time.
        torque: which torque it is.
        moving: which joints move, shape (n,).
        facts: what was repaired or left out, one sentence each.
    """

    name: str
    rate_hz: float
    segments: tuple[Segment, ...]
    torque: TorqueSource
    moving: NDArray[np.bool_]
    facts: tuple[str, ...]

    @property
    def samples(self) -> int:
        """Number of used samples in all segments."""
        return sum(len(s.span) for s in self.segments)

    @property
    def span_s(self) -> tuple[float, float]:
        """Time of the first used sample, and of the end [s]."""
        first, last = self.segments[0], self.segments[-1]
        return (
            first.start_s + first.span.start / self.rate_hz,
            last.start_s + last.span.stop / self.rate_hz,
        )


def dataset(
    recording: Recording,
    joint_names: Sequence[str],
    name: str,
    torque: TorqueSource | None = None,
) -> Dataset:
    """The recording's samples on a uniform grid.

    Args:
        recording: as read.
        joint_names: the robot's joints, n of them.
        name: what to call the log.
        torque: which one to use; None takes the commanded one where there is one.

    Raises:
        DataError: joints, stamps, or torque that cannot be used.
    """
    columns = _columns(recording, joint_names, name)
    stamps, order, facts = _increasing(recording.stamp_ns, name)
    t = (stamps - stamps[0]) * 1e-9
    period = float(np.median(np.diff(stamps))) * 1e-9
    torque = torque or ("commanded" if _has_command(recording) else "measured")
    q = _held_fixed(recording.q[order][:, columns])
    tau = _torque(recording, torque, stamps, period, name)[:, columns]
    wanted = _wanted(recording, stamps)
    wanted = None if wanted is None else wanted[:, columns]
    pieces = _unbroken(t, period)
    if len(pieces) > 1:
        holes = ", ".join(f"{t[b.start]:.3f} s" for b in pieces[1:])
        facts.append(f"holes of more than {_GAP_PERIODS} periods end at {holes}")
    segments = tuple(
        _uniform(t[p], q[p], tau[p], None if wanted is None else wanted[p], period) for p in pieces
    )
    moving = np.ptp(q, axis=0) > 0
    if not moving.any():
        raise DataError(f"{name}: no joint moves by more than {_HELD} rad; nothing can be learned.")
    held = tuple(n for n, moves in zip(joint_names, moving, strict=True) if not moves)
    if held:
        facts.append(f"held: {', '.join(held)}")
    return Dataset(name, round(1 / period, 6), segments, torque, moving, tuple(facts))


def _held_fixed(q: Array) -> Array:
    """Positions with each held joint at one place: its middle, or the right angle next to it."""
    low, high = q.min(axis=0), q.max(axis=0)
    middle = (low + high) / 2
    right_angle = np.round(middle / (np.pi / 2)) * (np.pi / 2)
    place = np.where(np.abs(middle - right_angle) < _HELD, right_angle, middle)
    return np.where(high - low < _HELD, place, q)


def _columns(recording: Recording, joint_names: Sequence[str], name: str) -> list[int]:
    present = recording.joint_names
    missing = [j for j in joint_names if j not in present]
    if missing:
        raise JointMismatchError(name, missing, present)
    return [present.index(j) for j in joint_names]


def _increasing(
    stamp_ns: NDArray[np.int64], name: str
) -> tuple[NDArray[np.int64], NDArray[np.int64], list[str]]:
    """Stamps without repetitions, their places, and what was left out."""
    if len(stamp_ns) < 2:
        raise DataError(f"{name} holds {len(stamp_ns)} samples; nothing can be learned from it.")
    steps = np.diff(stamp_ns)
    if (steps < 0).any():
        at = int(np.argmax(steps < 0)) + 1
        raise DataError(
            f"{name}: the stamp of sample {at} lies {-steps[at - 1] * 1e-9:g} s before the one"
            " ahead of it; sort or repair the recording."
        )
    order = np.concatenate([[0], 1 + np.flatnonzero(steps > 0)])
    repeated = len(stamp_ns) - len(order)
    facts = [f"{repeated} samples repeat the stamp before them and were left out"]
    return stamp_ns[order], order, facts if repeated else []


def _has_command(recording: Recording) -> bool:
    return recording.command is not None and recording.command.effort is not None


def _torque(
    recording: Recording,
    source: TorqueSource,
    stamps: NDArray[np.int64],
    period: float,
    name: str,
) -> Array:
    """Torque at the sampling instants, shape (S, n), columns as recorded."""
    if source == "measured":
        if recording.effort is None:
            raise DataError(f"{name} holds no measured torque; leave out --torque measured.")
        order = np.searchsorted(recording.stamp_ns, stamps)
        return recording.effort[order]
    command = recording.command
    if command is None or command.effort is None:
        raise DataError(f"{name} holds no commanded torque; leave out --torque commanded.")
    t = (command.stamp_ns - stamps[0]) * 1e-9
    return held_mean(t, command.effort, (stamps - stamps[0]) * 1e-9, period)


def held_mean(t: Array, held: Array, at: Array, period: float) -> Array:
    """Mean over one period around each instant of a signal that is held from stamp to stamp.

    The drives hold a torque until the next one comes; the torque that belongs to a position is
    therefore half of the one before it and half of the one after it, where both have the same
    stamps.

    Args:
        t: stamps of the signal [s], shape (C,).
        held: its values, shape (C, n).
        at: instants [s], shape (S,).
        period: length of the mean [s].
    """
    steps = np.diff(t, append=t[-1] + period)[:, None]
    area = np.concatenate([np.zeros((1, held.shape[1])), np.cumsum(held * steps, axis=0)])
    edges = np.append(t, t[-1] + period)
    low = np.clip(at - period / 2, edges[0], edges[-1])
    high = np.clip(at + period / 2, edges[0], edges[-1])
    span = np.maximum(high - low, 1e-12)
    means = [
        (np.interp(high, edges, column) - np.interp(low, edges, column)) / span for column in area.T
    ]
    return np.column_stack(means)


def _wanted(recording: Recording, stamps: NDArray[np.int64]) -> Array | None:
    """Reference position at the sampling instants, shape (S, n), columns as recorded, or None."""
    reference = recording.reference
    if reference is None or len(reference.stamp_ns) < 2:
        return None
    t = (reference.stamp_ns - stamps[0]) * 1e-9
    at = (stamps - stamps[0]) * 1e-9
    return np.column_stack([np.interp(at, t, column) for column in reference.q.T])


def _unbroken(t: Array, period: float) -> list[slice]:
    edges = [0, *(1 + np.flatnonzero(np.diff(t) > _GAP_PERIODS * period)), len(t)]
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _uniform(t: Array, q: Array, tau: Array, wanted: Array | None, period: float) -> Segment:
    grid = t[0] + period * np.arange(int(np.floor((t[-1] - t[0]) / period + _JITTER)) + 1)
    if len(grid) == len(t) and np.abs(grid - t).max() <= _JITTER * period:
        return Segment(float(t[0]), q, tau, wanted)
    wanted = None if wanted is None else resampled(t, wanted, grid)
    return Segment(float(t[0]), resampled(t, q, grid), resampled(t, tau, grid), wanted)


def resampled(t: Array, values: Array, grid: Array) -> Array:
    """Values at other instants, by the cubic through the four nearest samples, shape (G, n).

    Args:
        t: ascending stamps [s], shape (S,).
        values: shape (S, n).
        grid: instants inside the stamps [s], shape (G,).
    """
    if len(t) < 4:
        return np.column_stack([np.interp(grid, t, column) for column in values.T])
    first = np.clip(np.searchsorted(t, grid, side="right") - 2, 0, len(t) - 4)
    nodes = [t[first + k] for k in range(4)]
    result = np.zeros((len(grid), values.shape[1]))
    for k in range(4):
        weight = np.ones(len(grid))
        for other in range(4):
            if other != k:
                weight *= (grid - nodes[other]) / (nodes[k] - nodes[other])
        result += weight[:, None] * values[first + k]
    return result
