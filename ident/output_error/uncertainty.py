"""How well the settings of a fit are known.

Two kinds of error count. Residuals of different blocks of time are independent: how their pulls on
the settings scatter tells what chance does. And a model of another form than the arm's, of friction
that turns round otherwise say, errs alike whenever the joint moves alike: residuals at like speeds
are one error, however long they last. The two add up.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Prior, Setup, columns, coordinates, turned
from ident.output_error.parameters import ROW
from ident.signals.arrays import Array

_BLOCK_S = 2.0
_PACES = 8
"""Parts of a joint's speeds, from fast one way to fast the other, as many samples in each."""

_KNOWN_FACTOR = 0.3  # a torque scale that is known worse than this is not known


@dataclass(frozen=True)
class Knowledge:
    """What a fit knows.

    Attributes:
        sd: standard errors in the settings' units, NaN where not fitted, shape (quantities, n).
        torque_factor_sd: of the logarithm of a joint's torque-like settings together, from the
            recordings and the URDF's masses alone, shape (n,).
        deviations: standard deviations of each setting from nothing, whatever that factor, shape
            (quantities, n); of positive ones it says nothing.
    """

    sd: Array
    torque_factor_sd: Array
    deviations: Array


def knowledge(setup: Setup, found: Fit, prior: Prior) -> Knowledge:
    """Errors of chance and of the model's form, and of the scale of torque.

    A joint's settings are taken by themselves: those of others hardly move it.
    """
    pairs = np.argwhere(found.free)
    made = columns(setup, found.settings, found.free)
    speed = _speeds(setup, found.settings)
    n, samples = found.settings.shape[1], len(found.residuals)
    blocks = max(int(setup.seconds / _BLOCK_S), 8)
    edges = np.linspace(0, samples, blocks + 1).astype(int)[:-1]
    sd, factor = np.full(found.settings.shape, np.nan), np.full(n, np.inf)
    away, place = np.zeros(found.settings.shape), coordinates(found.settings)
    for j in range(n):
        mine = np.flatnonzero(pairs[:, 1] == j)
        if not len(mine):
            continue
        rows = pairs[mine, 0]
        J, left = made[mine, :, j], found.residuals[:, j]
        scores = np.add.reduceat(J * left, edges, axis=1)
        meat = scores @ scores.T * blocks / max(blocks - len(mine), 1)
        meat += alike(J * left, speed[:, j])
        correlated = np.trace(meat) / max(np.trace(J @ J.T) * np.mean(left**2), 1e-300)
        belief = np.diag(prior.sd[rows, j] ** -2.0) * np.mean(left**2) * max(correlated, 1.0)
        bread = np.linalg.inv(J @ J.T + belief)
        spread = bread @ (meat + belief * np.mean(left**2) * max(correlated, 1.0)) @ bread
        turn = turned(found.settings[:, j], rows)
        sd[rows, j] = np.sqrt(np.diag(turn @ spread @ turn.T))
        away[rows, j] = np.abs(place[rows, j]) / np.sqrt(np.diag(spread))
        factor[j] = _factor_sd(J, meat, rows)
    return Knowledge(sd, factor, away)


def unknown_factor(known: Knowledge) -> NDArray[np.bool_]:
    """Joints whose torques are known up to a common factor only, shape (n,)."""
    return known.torque_factor_sd > _KNOWN_FACTOR


def alike(pulls: Array, speed: Array) -> Array:
    """Covariance of the sum of pulls that are one error wherever the speed is alike, shape (p, p).

    Args:
        pulls: of each sample on each setting, shape (p, S).
        speed: of each sample, shape (S,).
    """
    order = np.argsort(speed, kind="stable")
    edges = np.linspace(0, len(speed), _PACES + 1).astype(int)[:-1]
    scores = np.add.reduceat(pulls[:, order], edges, axis=1)
    return scores @ scores.T * _PACES / (_PACES - 1)


def _speeds(setup: Setup, settings: Array) -> Array:
    """Of the simulated joints at the counted samples [rad/s], shape (S, n)."""
    pairs = zip(setup.segments, setup.replay(settings), strict=True)
    return np.concatenate([np.gradient(m, s.motion.t, axis=0)[s.counted :] for s, m in pairs])


def _factor_sd(J: Array, meat: Array, rows: Array) -> float:
    """Of the logarithm by which all torques of a joint could be larger together.

    That is the stiffness's own: what else is fitted gives way, the rotor less than the others.
    """
    place = np.flatnonzero(rows == ROW["stiffness"])
    if not len(place):
        return 0.0  # it is given, and all torques with it
    bread = np.linalg.pinv(J @ J.T, hermitian=True)
    return float(np.sqrt((bread @ meat @ bread)[place[0], place[0]]))
