"""How well the settings of a fit are known: blocks of time whose residuals count as independent."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Prior, Setup, columns
from ident.output_error.parameters import QUANTITIES, ROW
from ident.signals.arrays import Array

_BLOCK_S = 2.0
_TORQUES = (
    "stiffness", "integral", "rate_gain", "torque_limit", "armature", "damping", "coulomb",
    "stribeck", "offset", "spring", "drag", "skew",
)  # fmt: skip
_KNOWN_FACTOR = 0.3  # a torque scale that is known worse than this is not known


@dataclass(frozen=True)
class Knowledge:
    """What a fit knows.

    Attributes:
        sd: standard errors in the settings' units, NaN where not fitted, shape (22, n).
        torque_factor_sd: of the logarithm of a joint's torque-like settings together, from the
            recordings and the URDF's masses alone, shape (n,).
    """

    sd: Array
    torque_factor_sd: Array


def knowledge(setup: Setup, found: Fit, prior: Prior) -> Knowledge:
    """Sandwich errors over blocks of time, and of the scale of torque.

    A joint's settings are taken by themselves: those of others hardly move it.
    """
    pairs = np.argwhere(found.free)
    made = columns(setup, found.settings, found.free, found.residuals)
    n, samples = found.settings.shape[1], len(found.residuals)
    blocks = max(int(setup.seconds / _BLOCK_S), 8)
    edges = np.linspace(0, samples, blocks + 1).astype(int)[:-1]
    sd, factor = np.full(found.settings.shape, np.nan), np.full(n, np.inf)
    for j in range(n):
        mine = np.flatnonzero(pairs[:, 1] == j)
        if not len(mine):
            continue
        rows = pairs[mine, 0]
        J, left = made[mine, :, j], found.residuals[:, j]
        scores = np.add.reduceat(J * left, edges, axis=1)
        meat = scores @ scores.T * blocks / max(blocks - len(mine), 1)
        correlated = np.trace(meat) / max(np.trace(J @ J.T) * np.mean(left**2), 1e-300)
        belief = np.diag(prior.sd[rows, j] ** -2.0) * np.mean(left**2) * max(correlated, 1.0)
        bread = np.linalg.inv(J @ J.T + belief)
        spread = bread @ (meat + belief * np.mean(left**2) * max(correlated, 1.0)) @ bread
        # a coordinate's unit is its scale, or the value itself where it is a logarithm
        units = np.array([QUANTITIES[r].scale or found.settings[r, j] for r in rows], dtype=float)
        sd[rows, j] = np.sqrt(np.diag(spread)) * units
        factor[j] = _factor_sd(J, left, meat, rows, found.settings[:, j])
    return Knowledge(sd, factor)


def unknown_factor(known: Knowledge) -> NDArray[np.bool_]:
    """Joints whose torques are known up to a common factor only, shape (n,)."""
    return known.torque_factor_sd > _KNOWN_FACTOR


def _factor_sd(J: Array, left: Array, meat: Array, rows: Array, settings: Array) -> float:
    """Of the logarithm by which all torques of a joint could be larger together."""
    names = [QUANTITIES[r].name for r in rows]
    along = np.array(
        [
            0.0
            if name not in _TORQUES
            else (1.0 if QUANTITIES[ROW[name]].scale == 0.0 else
                  settings[ROW[name]] / QUANTITIES[ROW[name]].scale)
            for name in names
        ]
    )  # fmt: skip
    slope = along @ J
    if float(slope @ slope) == 0.0:
        return float("inf")
    return float(np.sqrt(along @ meat @ along) / (slope @ slope))
