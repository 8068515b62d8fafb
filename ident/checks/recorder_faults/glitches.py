"""Single samples that no joint can have measured, such as bits that flipped in a log.

A sample that lies beyond both of its neighbours is an extremum of the motion, or noise, or wrong.
A joint would have to go out and back within two samples: at its fastest steps it comes no farther
than these. Torque may change at once, so that only what lies far beyond its whole range is wrong,
or beyond most of its range where such steps out and back are rare and else far smaller.
Wrong samples are replaced by the cubic through their neighbours, where they are few.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.recordings.dataset import Dataset, Parts
from ident.recordings.samples import ROUNDING, filled, smallest_step
from ident.regression.probe import Chunk, chunks_of
from ident.signals.arrays import Array

_FASTEST = 0.99
"""Quantile of a joint's steps that stands for its fastest."""

_NOISE = 0.99
"""Quantile of the distances beyond both neighbours that stands for noise."""

_RANGE = (0.02, 0.98)
"""Quantiles between which a torque lies but for outliers, a hundredth of its samples at most."""

_STEPS = 3.0
"""Smallest moves of an encoder that a sample may be off."""


_HARMLESS = 2e-3
"""Of a joint's range: what a single sample may be off without a filter leaving anything of it."""


@dataclass(frozen=True)
class Bounds:
    """How far a sample may lie beyond both of its neighbours.

    Attributes:
        q: position [rad], shape (n,); infinite for joints that do not move.
        tau: torque [N m], shape (n,).
    """

    q: Array
    tau: Array


def glitch_remarks(
    data: Dataset, names: Sequence[str], bounds: CheckSettings
) -> tuple[Dataset, list[Remark]]:
    """The recording without wrong samples, and what is said of them.

    Args:
        data: the recording.
        names: of the joints.
        bounds: of the checks.
    """
    most = _bounds(chunks_of([data]), data.moving, bounds)
    counts = np.zeros((2, len(names)), dtype=int)
    farthest = np.zeros(len(names))
    for _, part in data.read():
        for row, values, limit in ((0, part.q, most.q), (1, part.tau, most.tau)):
            far = beyond_neighbours(values)
            counts[row] += (far > limit).sum(axis=0)
            if row == 0 and len(far):
                farthest = np.maximum(farthest, far.max(axis=0))
    if not 0 < counts.sum(axis=0).max() <= bounds.glitch_share * data.samples:
        return data, []
    mended = replace(data, read=partial(_mended, data, most))
    places = np.flatnonzero(counts.any(axis=0))
    told = []
    if counts[0].any():
        k = int(np.argmax(farthest * (counts[0] > 0)))
        told.append(
            f"{_counted(counts[0].sum(), 'position')} out and back from one sample to the next, by"
            f" up to {farthest[k]:.2g} rad (joint {k + 1})"
        )
    if counts[1].any():
        told.append(f"{_counted(counts[1].sum(), 'torque')} far out of range and back")
    text = (
        f"{data.name}: {' and '.join(told)}, at {joints(places, names)}: no joint does that. These"
        " samples were interpolated; others may be wrong without showing it."
    )
    advice = (
        "Check the cables, the bus and the recorder, and use logs with checksums, so that damage"
        " is seen."
    )
    return mended, [Remark("glitches", numbers(places), text, Grade.DOUBTFUL, advice)]


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s jump' if count > 1 else ' jumps'}"


def beyond_neighbours(values: Array) -> Array:
    """How far each sample lies beyond both of its neighbours, shape (S, n); 0 at the ends."""
    far = np.zeros_like(values)
    if len(values) < 3:
        return far
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    least = np.minimum(np.abs(before), np.abs(after))
    far[1:-1] = np.where(before * after > 0, least, 0.0)
    return far


def _bounds(chunks: Sequence[Chunk], moving: NDArray[np.bool_], bounds: CheckSettings) -> Bounds:
    q = np.full(len(moving), np.inf)
    tau = np.full(len(moving), np.inf)
    for k in np.flatnonzero(moving):
        steps = np.concatenate([np.abs(np.diff(c.q[:, k])) for c in chunks])
        far = np.concatenate([beyond_neighbours(c.q[:, [k]])[:, 0] for c in chunks])
        q[k] = max(
            float(np.quantile(steps, _FASTEST)),
            bounds.glitch_noise * float(np.quantile(far, _NOISE)),
            _STEPS * smallest_step(steps),
            _HARMLESS * max(float(np.ptp(c.q[:, k])) for c in chunks),
        )
        torque = np.concatenate([c.tau[:, k] for c in chunks])
        back = np.concatenate([beyond_neighbours(c.tau[:, [k]])[:, 0] for c in chunks])
        span = float(np.ptp(np.quantile(torque, _RANGE)))
        rare = max(span, bounds.glitch_torque_noise * float(np.quantile(back, _NOISE)))
        tau[k] = min(bounds.glitch_ranges * span, rare) if span > ROUNDING else np.inf
    return Bounds(q, tau)


def _mended(data: Dataset, most: Bounds) -> Parts:
    for number, part in data.read():
        q = filled(part.q, beyond_neighbours(part.q) > most.q)
        tau = filled(part.tau, beyond_neighbours(part.tau) > most.tau)
        yield number, replace(part, q=q, tau=tau)
