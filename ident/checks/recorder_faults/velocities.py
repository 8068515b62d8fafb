"""Recorded velocities beside the positions of the same log: both must tell of one way.

Positions that stay the same meanwhile are those of an encoder that is stuck.

The way is compared, not the speed: noise and the low-pass of a velocity hardly change its integral.
Which of the two is wrong the log cannot tell. Velocities in another unit of angle are let be, and
differences of positions that the recorder held, whose copies were left out: they are used for
nothing else.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.checks.settings import CheckSettings
from ident.recordings.dataset import Dataset
from ident.recordings.log_summary import GAP_PERIODS, LogSummary
from ident.signals.arrays import Array

_MOST_SAMPLES = 100_000
_STUCK_S = 0.5  # that a position stays the same to the last bit
_STUCK_WAY = 0.2  # of the joint's range, that its velocity goes meanwhile
_STUCK_SPEED = 0.3  # of the joint's rms speed, that it has meanwhile: less is noise at rest
_UNITS = (180 / np.pi, 30 / np.pi)  # degrees per second, turns per minute


def velocity_remarks(
    data: Dataset, names: Sequence[str], in_degrees: NDArray[np.bool_], bounds: CheckSettings
) -> list[Remark]:
    """Joints whose velocity is that of their position times a factor.

    Args:
        data: the recording.
        names: of the joints.
        in_degrees: joints whose positions were taken for degrees, shape (n,).
        bounds: of the checks.
    """
    stretches = list(_stretches(data, names))
    if not stretches:
        return []
    q, way = (np.concatenate(parts) for parts in zip(*stretches, strict=True))
    q *= np.where(in_degrees, np.pi / 180, 1.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = np.sum(q * way, axis=0) / np.sum(q * q, axis=0)
        left, apart, whole = (np.linalg.norm(x, axis=0) for x in (way - factor * q, way - q, way))
        off = data.moving & (np.abs(factor - 1) > bounds.scale_off)
        off &= left < bounds.believed_ratio * np.minimum(apart, whole)
    wrong = np.flatnonzero(off).tolist()
    known = *_UNITS, data.source.copies
    if not wrong or any(np.ptp([*factor[wrong], u]) < bounds.scale_off * u for u in known):
        return []
    told = [f"{factor[j]:.3g} times that of its positions at {joints([j], names)}" for j in wrong]
    if np.ptp(factor[wrong]) < bounds.scale_off:
        told = [f"{np.mean(factor[wrong]):.3g} times that of the positions at"]
        told[0] += f" {joints(wrong, names)}"
    text = (
        f"{data.name}: the way that the recorded velocities tell is {joined(told)}, so that"
        " positions, velocities or stamps are in a wrong scale."
    )
    advice = (
        "Check the stamps, and the encoders' counts per turn and gear ratios by which both are"
        " computed: the positions were used as they are."
    )
    return [Remark("positions", numbers(wrong), text, Grade.DOUBTFUL, advice)]


def stuck_remarks(data: Dataset, names: Sequence[str]) -> list[Remark]:
    """Joints whose position stays the same while their velocity goes on.

    Args:
        data: the recording.
        names: of the joints.
    """
    places = [data.source.joint_names.index(name) for name in names]
    longest = np.zeros(len(names))
    parts = list(unbroken(data.source, places))
    if not parts:
        return []
    span = np.ptp(np.concatenate([q for _, q, _ in parts]), axis=0)
    usual = _rms(np.concatenate([qd for _, _, qd in parts]))
    for t, q, qd in parts:
        way = np.cumsum(qd[1:] * np.diff(t)[:, None], axis=0)
        for j in np.flatnonzero(data.moving):
            for first, end in _unchanged(q[:, j]):
                lasts = t[end] - t[first]
                if lasts <= max(_STUCK_S, longest[j]):
                    continue
                fast = _rms(qd[first:end, j]) > _STUCK_SPEED * usual[j]
                if fast and np.ptp(way[first:end, j]) > _STUCK_WAY * span[j]:
                    longest[j] = lasts
    stuck = np.flatnonzero(longest).tolist()
    if not stuck:
        return []
    told = joined([f"{joints([j], names)} for {longest[j]:.2g} s" for j in stuck])
    text = f"{data.name}: the recorded position stays the same at {told}, and its velocity moves."
    advice = "Check that encoder and its connection; cut the recording where it stops."
    return [Remark("positions", numbers(stuck), text, Grade.DOUBTFUL, advice)]


def _rms(x: Array) -> Array:
    return np.sqrt(np.mean(x**2, axis=0))


def _unchanged(q: Array) -> Iterator[tuple[int, int]]:
    """First and last sample of each run of equal positions."""
    same = np.concatenate([[False], np.diff(q) == 0.0, [False]])
    edges = np.flatnonzero(np.diff(same.astype(int)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _stretches(data: Dataset, names: Sequence[str]) -> Iterator[tuple[Array, Array]]:
    """Position, and integral of the velocity, of each stretch without a hole, less their trend."""
    source = data.source
    places = [source.joint_names.index(name) for name in names]
    for t, q, qd in unbroken(source, places):
        step = np.diff(t)[:, None]
        way = np.cumsum(0.5 * (qd[1:] + qd[:-1]) * step, axis=0)
        line = np.column_stack([np.ones(len(way)), t[1:]])
        q, way = (x - line @ np.linalg.lstsq(line, x, rcond=None)[0] for x in (q[1:], way))
        yield q, way


def unbroken(source: LogSummary, places: Sequence[int]) -> Iterator[tuple[Array, Array, Array]]:
    """Time [s], position and velocity of the first stretches without a hole."""
    kept, count = [], 0
    for piece in source.pieces():
        states = piece.states
        if states is None:
            continue
        if states.qd is None or count > _MOST_SAMPLES:
            break
        t = (states.stamp_ns - source.first_ns) * 1e-9
        kept.append((t, states.positions[:, places], states.qd[:, places]))
        count += len(t)
    if not kept:
        return
    t, q, qd = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    holes = np.flatnonzero(np.diff(t) > GAP_PERIODS * source.period_s) + 1
    for rows in np.split(np.arange(len(t)), holes):
        if len(rows) > 2:
            yield t[rows], q[rows], qd[rows]
