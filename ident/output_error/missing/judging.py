"""How two settings of an arm compare on recordings that neither was fitted to."""

import numpy as np

from ident.output_error.fit import Setup
from ident.signals.arrays import Array

BLOCK_S = 1.0
"""Errors of blocks of this length count as independent."""


_TINY = 1e-30


def block_errors(setup: Setup, settings: Array) -> Array:
    """Mean squared error of each block of time, by joint [rad^2], shape (B, n)."""
    means = []
    for segment, made in zip(setup.segments, setup.replay(settings), strict=True):
        t = segment.motion.t[segment.counted :]
        squares = (segment.q - made)[segment.counted :] ** 2
        count = max(int((t[-1] - t[0]) / BLOCK_S), 1)
        edges = np.searchsorted(t, np.linspace(t[0], t[-1], count + 1)[:-1])
        sizes = np.diff(np.append(edges, len(t)))
        means.append(np.add.reduceat(squares, edges, axis=0) / sizes[:, None])
    return np.concatenate(means)


def rms(errors: Array) -> Array:
    """Over all blocks [rad], shape (n,)."""
    return np.sqrt(errors.mean(axis=0))


def typical(errors: Array) -> Array:
    """Error of the typical block [rad], shape (n,): the geometric mean of their rms.

    Where a joint without weight comes to rest, on one side of its friction or on the other, the
    smallest forces decide: a few blocks in which it rests on the wrong side would outweigh all
    others in a mean square.
    """
    return np.exp(0.5 * np.log(np.maximum(errors, _TINY)).mean(axis=0))


def gain(before: Array, after: Array) -> Array:
    """Nats per sample by which the typical error becomes smaller, by joint, shape (n,)."""
    return np.log(typical(before) / typical(after))


def sureness(before: Array, after: Array) -> Array:
    """Standard errors by which `after` is better over blocks, by joint, shape (n,)."""
    better = 0.5 * np.log(np.maximum(before, _TINY) / np.maximum(after, _TINY))
    spread = better.std(axis=0, ddof=1) / np.sqrt(len(better))
    return gain(before, after) / np.maximum(spread, _TINY)


def explained(before: Array, after: Array) -> Array:
    """Position error that `after` explains beyond `before` in the typical block [rad]."""
    return np.sqrt(np.maximum(typical(before) ** 2 - typical(after) ** 2, 0.0))
