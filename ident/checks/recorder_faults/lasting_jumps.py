"""Positions that jump from one sample to the next and stay there: no joint does that.

An encoder lost counts, or its reading stood still and was then caught up with. A joint's steps are
like those around them; one that is not, by far more than the joint's others, is no motion.
"""

from collections.abc import Sequence

import numpy as np

from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.recordings.dataset import Dataset
from ident.recordings.samples import ROUNDING
from ident.regression.probe import Chunk
from ident.signals.arrays import Array

_USUAL = 0.99
"""Quantile of how far a joint's steps lie from those around them that stands for its motion."""

_FAR = 10.0
"""Times that, by which a step is no motion."""

_LEAST = 5e-3
"""Of a joint's range: what a smaller jump does is lost among other errors."""

_KEPT = 0.5
"""Of a jump, that is still there some steps later."""

_BESIDE = 1
"""Steps on both sides over which uneven stamps may spread a jump."""

_AROUND = 4
"""Steps on both sides that show how the joint moves there, and whether it stays."""

_STOOD_S = 0.1
"""Time for which a reading stayed the same before, from which that is told."""


def lasting_jumps(
    data: Sequence[Dataset], chunks: Sequence[Chunk], names: Sequence[str]
) -> list[Remark]:
    """Joints whose reading jumps and stays.

    Args:
        data: the recordings.
        chunks: their samples.
        names: of the joints.
    """
    found = []
    for log, one in enumerate(data):
        own = [c for c in chunks if c.log == log]
        told: dict[int, str] = {}
        for j in np.flatnonzero(one.moving).tolist():
            beyond = [_beyond(c.q[:, j]) for c in own]
            usual = float(np.quantile(np.abs(np.concatenate(beyond)), _USUAL))
            span = np.ptp(np.concatenate([c.q[:, j] for c in own]))
            least = max(_FAR * usual, _LEAST * float(span))
            pairs = zip(own, beyond, strict=True)
            jumps = [(c, k) for c, far in pairs for k in _lasting(far, least)]
            if jumps:
                told[j] = f"{joints([j], names)} by {_largest(jumps, j)}"
        if told:
            text = (
                f"{one.name}: the position jumps from one sample to the next, and stays there, at"
                f" {joined([*told.values()])}: an encoder lost counts, or its reading stood still."
            )
            advice = "Check that encoder and its connection; cut the recording there."
            found.append(Remark("jumps", numbers([*told]), text, Grade.DOUBTFUL, advice))
    return found


def _beyond(q: Array) -> Array:
    """How far each step lies from the median of those around it, shape (S - 1,); 0 at the ends."""
    step, reach = np.diff(q), _BESIDE + _AROUND
    if len(step) <= 2 * reach:
        return np.zeros(len(step))
    around = np.lib.stride_tricks.sliding_window_view(step, 2 * reach + 1)
    beside = np.delete(around, np.arange(_AROUND, _AROUND + 2 * _BESIDE + 1), axis=1)
    return np.pad(step[reach:-reach] - np.median(beside, axis=1), reach)


def _lasting(beyond: Array, least: float) -> list[int]:
    """Steps that lie so far from those around them, and that the next ones do not undo."""
    found, reach = [], _BESIDE + _AROUND
    for k in np.flatnonzero(np.abs(beyond) > least).tolist():
        here = beyond[k - reach : k + reach + 1]
        largest = abs(beyond[k]) == np.abs(here).max()
        if largest and here.sum() / beyond[k] > _KEPT:
            found.append(k)
    return found


def _largest(jumps: Sequence[tuple[Chunk, int]], joint: int) -> str:
    """The largest jump, where it is, and how long the reading had stayed the same."""
    chunk, k = max(jumps, key=lambda at: abs(at[0].q[at[1] + 1, joint] - at[0].q[at[1], joint]))
    q = chunk.q[:, joint]
    moved = np.flatnonzero(np.abs(np.diff(q[: k - _BESIDE + 1])) > ROUNDING)
    stood_s = (k - _BESIDE - (moved[-1] + 1 if len(moved) else 0)) / chunk.rate_hz
    more = f" ({len(jumps)} times)" if len(jumps) > 1 else ""
    before = f", after {stood_s:.2g} s without any change" if stood_s > _STOOD_S else ""
    at_s = chunk.start_s + k / chunk.rate_hz
    return f"{abs(q[k + 1] - q[k]):.2g} rad at {at_s:.4g} s{before}{more}"
