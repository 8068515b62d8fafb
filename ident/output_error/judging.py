"""How well a model predicts motion that it was not fitted to, and how two of them compare.

Each stretch of time is predicted by a fit of all the others, in first order: leaving it out moves
the settings by what it pulled at them. All of a recording so fits and judges, unbroken, and one fit
is enough; a simulation that begins anew in the middle of a motion is off for as long as friction
remembers how it came there.
"""

import itertools

import numpy as np

from ident.output_error.coordinates import bounds
from ident.output_error.fit import Fit
from ident.output_error.parameters import QUANTITIES
from ident.output_error.setup import MEMORY_S, Prior, Setup
from ident.output_error.slopes import columns
from ident.signals.arrays import Array

BLOCK_S = 1.0
"""Errors of blocks of this length count as independent."""

_TOGETHER = 2
"""Blocks that are left out at once: what is beside them would tell of them."""

_FIRST_ORDER = 1.0
"""Change of a setting's logarithm up to which a simulation's first order says where it goes: a
limit that the rest of a recording never reaches would leave it without end."""

_TINY = 1e-30


def left_out(setup: Setup, found: Fit, prior: Prior) -> Array:
    """Mean squared error of each block of time, predicted from the others [rad^2], shape (B, n).

    None is less than that of an encoder's steps: where a joint rests, chance decides how near to
    the step that was read a prediction comes. A joint's settings are taken by themselves, and those
    that lie on a bound for fixed.

    Args:
        setup: the recordings that were fitted.
        found: their fit.
        prior: what was believed.
    """
    pairs, edges = np.argwhere(found.free), blocks(setup)
    made = columns(setup, found.settings, found.free)
    low, high = bounds()
    logs = np.array([QUANTITIES[row].scale == 0.0 for row in pairs[:, 0]])
    loose = ((low < found.settings) & (found.settings < high))[found.free]
    starts = edges[:-1:_TOGETHER]
    predicted = found.residuals.copy()
    for j, r in enumerate(found.residuals.T):
        mine = np.flatnonzero((pairs[:, 1] == j) & loose)
        J = made[mine, :, j]
        share = max(np.mean(r**2), _TINY) * len(r) * MEMORY_S / setup.seconds
        hessian = J @ J.T + np.diag(share * prior.sd[pairs[mine, 0], j] ** -2.0)
        for a, b in itertools.pairwise([*starts, edges[-1]]):
            own = J[:, a:b]
            step = np.linalg.solve(hessian - own @ own.T, own @ r[a:b])
            farthest = np.abs(step[logs[mine]]).max(initial=_FIRST_ORDER)
            predicted[a:b, j] += _FIRST_ORDER / farthest * own.T @ step
    return of_blocks(setup, predicted)


def of_blocks(setup: Setup, residuals: Array) -> Array:
    """Mean squared error of each block of time, none less than of an encoder's step, shape (B, n).

    Args:
        setup: the recordings.
        residuals: along them [rad], shape (S, n).
    """
    edges = blocks(setup)
    errors = np.add.reduceat(residuals**2, edges[:-1], axis=0) / np.diff(edges)[:, None]
    return np.maximum(errors, setup.resolution**2 / 12.0)


def blocks(setup: Setup) -> list[int]:
    """First sample of each block among all segments' counted ones, and their number at the end."""
    edges, before = [], 0
    for segment in setup.segments:
        t = segment.motion.t[segment.counted :]
        starts = np.linspace(t[0], t[-1], max(int((t[-1] - t[0]) / BLOCK_S), 1) + 1)[:-1]
        edges += (before + np.searchsorted(t, starts)).tolist()
        before += len(t)
    return [*edges, before]


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


def sureness_of_all(before: Array, after: Array) -> float:
    """Standard errors by which `after` is better over blocks of all joints together."""
    means = (np.exp(np.log(np.maximum(x, _TINY)).mean(axis=1)) for x in (before, after))
    return float(sureness(*means))


def explained(before: Array, after: Array) -> Array:
    """Position error that `after` explains beyond `before` in the typical block [rad]."""
    return np.sqrt(np.maximum(typical(before) ** 2 - typical(after) ** 2, 0.0))
