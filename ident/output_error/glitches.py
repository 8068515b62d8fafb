"""Positions that no motion can reach, such as a wrong byte leaves in a log.

One of 3 rad would outweigh all others in the errors of a fit. However fast a joint is, it needs two
samples at least to show it: the lesser of two steps in a row the same way. A sample that would ask
for three times as much from the last one that was right is wrong, for as long as it takes to come
back within reach.
"""

import numpy as np
from numpy.typing import NDArray

from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

_FASTER = 3.0
"""Times a joint's fastest pair of steps; its largest step was 1.5 times that on a hobby arm."""

_LEAST = 0.03  # rad a sample: smaller jumps weigh little among thousands of samples
_MOST = 0.01  # of the samples: more are no accidents, but a rate too low to judge by


def unreachable(t: Array, q: Array) -> NDArray[np.bool_]:
    """Which positions are wrong, shape (S, n): none where they would be more than a hundredth.

    Args:
        t: their instants [s], shape (S,), rising.
        q: positions one sample after the other [rad], shape (S, n).
    """
    period = float(np.median(np.diff(t)))
    speed = np.diff(q, axis=0) / np.maximum(np.diff(t), period)[:, None]
    pair = np.minimum(np.abs(speed[1:]), np.abs(speed[:-1]))
    fastest = np.max(pair, axis=0, where=speed[1:] * speed[:-1] > 0.0, initial=0.0)
    reach = np.maximum(_FASTER * fastest, _LEAST / period)
    wrong = np.zeros(q.shape, dtype=bool)
    for j, most in enumerate(reach):
        column = np.ascontiguousarray(q[:, j])
        back = _beyond(-t[::-1], column[::-1].copy(), period, most)[::-1]
        ways = _beyond(t, column, period, most), back
        found = min(ways, key=np.count_nonzero)
        if np.count_nonzero(found) <= _MOST * len(q):
            wrong[:, j] = found
    return wrong


@compiled
def _beyond(t, q, period, most):
    """Which samples ask for more than that speed since the last one that did not."""
    wrong, right = np.zeros(q.size, dtype=np.bool_), 0
    for k in range(1, q.size):
        wrong[k] = abs(q[k] - q[right]) > most * max(t[k] - t[right], period)
        if not wrong[k]:
            right = k
    return wrong
