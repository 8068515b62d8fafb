"""Where a fit begins: servo, friction, and rotor by regression on smoothed positions.

A servo's error times its stiffness is what inertia, damping, friction, and gravity take; divided
by the stiffness this is linear, and gravity, which the links' masses tell, gives the stiffness.
"""

import numpy as np
from scipy.signal import savgol_filter

from ident.dynamics.compiled_chain import torques
from ident.output_error.fit import Setup
from ident.output_error.parameters import QUANTITIES, ROW
from ident.signals.arrays import Array

_SMOOTHED_S = 0.14
_SURE = 5.0  # standard errors of the load's coefficient from which it tells the stiffness
_WITHIN = 5.0  # of the joints' median, or of what the arm's file says
_MOVING = 0.05  # of the fastest speed
_LEAST = 1e-3  # of the stiffness, for what came out negative


def neutral(n: int) -> Array:
    """Settings before any data, shape (22, n)."""
    return np.array([[q.first] * n for q in QUANTITIES])


def first_guess(setup: Setup, known: Array, *, same_servo: bool) -> Array:
    """Settings of an arm with linear servos and dry friction, shape (22, n).

    Args:
        setup: the recordings.
        known: settings from elsewhere, shape (22, n); NaN where nothing is known.
        same_servo: whether all joints have the same, so also the same stiffness.
    """
    parts = [_smoothed(setup, k) for k in range(len(setup.stretches))]
    q, v, a, load = (np.concatenate(p) for p in zip(*parts, strict=True))
    n = q.shape[1]
    settings = np.where(np.isnan(known), neutral(n), known)
    betas, stiffness = np.zeros((5, n)), np.full(n, np.nan)
    for j in range(n):
        moving = np.abs(v[:, j]) > _MOVING * np.abs(v[:, j]).max()
        columns = [load[:, j], a[:, j], v[:, j], np.sign(v[:, j]), np.ones(len(v))]
        X = np.column_stack(columns)[moving]
        error = _errors(setup, j, settings[ROW["delay"], j])[moving]
        betas[:, j], *_ = np.linalg.lstsq(X, error, rcond=None)
        left = np.mean((error - X @ betas[:, j]) ** 2) * np.linalg.pinv(X.T @ X)
        if betas[0, j] > _SURE * np.sqrt(left[0, 0]):
            stiffness[j] = 1.0 / betas[0, j]
    if np.isnan(known[ROW["stiffness"]]).any():
        told = np.isfinite(stiffness)
        usual = float(np.median(stiffness[told])) if told.any() else QUANTITIES[0].first
        near = np.clip(np.where(told, stiffness, usual), usual / _WITHIN, usual * _WITHIN)
        settings[ROW["stiffness"]] = usual if same_servo else near
    for name, share in zip(("armature", "damping", "coulomb"), betas[1:4], strict=True):
        if np.isnan(known[ROW[name]]).any():
            settings[ROW[name]] = np.maximum(share, _LEAST) * settings[ROW["stiffness"]]
    return settings


def _errors(setup: Setup, joint: int, delay: float) -> Array:
    """What the command was ahead of the position, all stretches stacked [rad], shape (S,)."""
    ahead = []
    for s in setup.stretches:
        held = np.searchsorted(s.motion.stamp, s.motion.t - delay, side="right") - 1
        ahead.append(s.motion.command[np.maximum(held, 0), joint] - s.q[:, joint])
    return np.concatenate(ahead)


def _smoothed(setup: Setup, k: int) -> tuple[Array, Array, Array, Array]:
    s = setup.stretches[k]
    period = float(np.median(np.diff(s.motion.t)))
    width = min(max(5, 2 * int(_SMOOTHED_S / period / 2) + 1), len(s.q) - (1 - len(s.q) % 2))
    q, v, a = (
        np.asarray(savgol_filter(s.q, width, 3, deriv=d, delta=period, axis=0), order="C")
        for d in range(3)
    )
    load = torques(setup.chain, setup.delta, q, v, a)
    return q, v, a, load
