"""How well the settings of a fit are known.

Three kinds of error count. Residuals of different blocks of time are independent: how the settings
move where one block after the other is left out tells what chance does. And a model of another form
than the arm's, of friction that turns round otherwise say, errs alike whenever the joint moves
alike: residuals at like speeds are one error, however long they last. And the URDF's centres of
mass are a little off: what lifts little knows no torque by its weight. The three add up.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.output_error.coordinates import coordinates, turned
from ident.output_error.fit import Fit
from ident.output_error.parameters import PER_STIFFNESS, QUANTITIES, ROW
from ident.output_error.setup import MEMORY_S, Prior, Setup
from ident.output_error.slopes import SLOPE_STEP_S, sure_columns
from ident.signals.arrays import Array

_BLOCK_S = 2.0
_PACES = 8
"""Parts of a joint's speeds, from fast one way to fast the other, as many samples in each."""

_CENTRE_M = 0.001
"""Of a URDF's centres of mass, along each axis: screws, cables and glue are in none."""

_LINK, _MOMENT, _MASS = 10, slice(6, 9), 9
"""Parameters of a link, and which of them are its first moment and mass."""

_KNOWN_FACTOR = 0.3  # a torque scale that is known worse than this is not known
_Z90 = 1.645  # standard deviations of a normal distribution to its 5 and 95 %


@dataclass(frozen=True)
class Knowledge:
    """What a fit knows.

    Attributes:
        sd: standard errors in the settings' units, NaN where not fitted, shape (quantities, n); of
            positive ones the longer side of their 90 % interval, over 1.645.
        torque_factor_sd: of the logarithm of a joint's torque-like settings together, shape (n,).
        deviations: standard deviations of each setting from nothing, whatever that factor, shape
            (quantities, n); of positive ones it says nothing.
    """

    sd: Array
    torque_factor_sd: Array
    deviations: Array


def knowledge(setup: Setup, found: Fit, prior: Prior) -> Knowledge:
    """Errors of chance and of the model's form, and of the scale of torque."""
    pairs, usual = np.argwhere(found.free), np.maximum(found.rms, 1e-12)
    made = sure_columns(setup, found.settings, found.free, prior) / usual
    left = found.residuals / usual
    memory = len(left) * MEMORY_S / setup.seconds  # samples that say the same
    belief = memory * prior.pull(found.settings, found.free)[0]
    hessian = belief + np.einsum("asj,bsj->ab", made, made, optimize=True)
    inverse = np.linalg.inv(hessian)
    spread = memory * inverse @ belief @ inverse
    blocks = max(int(setup.seconds / _BLOCK_S), 8)
    spread += jackknifed(made, left, hessian, blocks)
    for j, speed in enumerate(_speeds(setup, found.settings).T):
        spread += inverse @ alike(made[:, :, j] * left[:, j], speed) @ inverse
    for moved in _by_centres(setup, found.settings):
        pull = inverse @ np.einsum("asj,sj->a", made, moved / usual)
        spread += np.outer(pull, pull)
    sd, factor = np.full(found.settings.shape, np.nan), np.full(left.shape[1], np.inf)
    away, place = np.zeros(found.settings.shape), coordinates(found.settings)
    for j in np.unique(pairs[:, 1]):
        mine = np.flatnonzero(pairs[:, 1] == j)
        rows, cov = pairs[mine, 0], spread[np.ix_(mine, mine)]
        sd[rows, j] = _in_units(found.settings[:, j], rows, cov)
        away[rows, j] = np.abs(place[rows, j]) / np.sqrt(np.diag(cov))
        scale = rows == ROW["stiffness"]  # if it is given, all torques are given with it
        factor[j] = np.sqrt(np.diag(cov)[scale].sum())
    return Knowledge(sd, factor, away)


def _by_centres(setup: Setup, settings: Array) -> Iterator[Array]:
    """What centres of mass that are off do to the positions [rad], shape (S, n) each."""
    setup = replace(setup, step=max(setup.step, SLOPE_STEP_S))
    now = setup.residuals(settings)
    for k in range(0, len(setup.delta), _LINK):
        for axis in range(_MOMENT.start, _MOMENT.stop):
            delta = setup.delta.copy()
            delta[k + axis] += _CENTRE_M * delta[k + _MASS]
            yield replace(setup, delta=delta).residuals(settings) - now


def unknown_factor(known: Knowledge) -> NDArray[np.bool_]:
    """Joints whose torques are known up to a common factor only, shape (n,)."""
    return known.torque_factor_sd > _KNOWN_FACTOR


def jackknifed(J: Array, left: Array, hessian: Array, blocks: int) -> Array:
    """Covariance of the settings from how leaving out a block of time moves them, shape (p, p).

    Args:
        J: change of the samples per setting, shape (p, S, n).
        left: residuals, shape (S, n).
        hessian: of all samples and what is believed, shape (p, p).
        blocks: how many there are.
    """
    edges = np.linspace(0, len(left), blocks + 1).astype(int)
    moved = np.empty((blocks, len(J)))
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        own = J[:, a:b].reshape(len(J), -1)
        moved[k] = np.linalg.solve(hessian - own @ own.T, own @ left[a:b].ravel())
    return (blocks - 1) / blocks * moved.T @ moved


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


def _in_units(settings: Array, rows: NDArray[np.int64], cov: Array) -> Array:
    """Standard errors of a joint's settings, in their units, shape (p,)."""
    turn = turned(settings, rows)
    sd = np.sqrt(np.diag(turn @ cov @ turn.T))
    positive = np.array([QUANTITIES[row].scale == 0.0 for row in rows])
    scaled = np.array([QUANTITIES[row].name in PER_STIFFNESS for row in rows])
    sd[positive] = settings[rows][positive] * _longer(sd[positive] / settings[rows][positive])
    scale = np.sqrt(np.diag(cov)[rows == ROW["stiffness"]].sum())
    if scale > 0.0:
        sd[scaled & ~positive] *= _longer(scale) / scale
    return sd


def _longer(sd: Any) -> Any:
    """Of a logarithm's standard errors: the longer side of a factor's 90 % interval, as one."""
    return np.expm1(_Z90 * sd) / _Z90


def _speeds(setup: Setup, settings: Array) -> Array:
    """Of the simulated joints at the counted samples [rad/s], shape (S, n)."""
    pairs = zip(setup.segments, setup.replay(settings), strict=True)
    return np.concatenate([np.gradient(m, s.motion.t, axis=0)[s.counted :] for s, m in pairs])
