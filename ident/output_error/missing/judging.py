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


def gain(before: Array, after: Array) -> Array:
    """Nats per sample by which the errors become smaller, by joint, shape (n,)."""
    return 0.5 * np.log(before.mean(axis=0) / after.mean(axis=0))


def sureness(before: Array, after: Array) -> Array:
    """Standard errors by which `after` is better over blocks, by joint, shape (n,).

    Blocks are compared by the logarithms of their errors: a few large ones decide nothing.
    """
    better = np.log(np.maximum(before, _TINY) / np.maximum(after, _TINY))
    spread = better.std(axis=0, ddof=1) / np.sqrt(len(better))
    return better.mean(axis=0) / np.maximum(spread, _TINY)


def explained(before: Array, after: Array) -> Array:
    """Rms of what `after` explains beyond `before` [rad], shape (n,)."""
    return np.sqrt(np.maximum(before.mean(axis=0) - after.mean(axis=0), 0.0))
