"""Where a fit begins: servo, friction, and rotor by regression on smoothed positions.

A servo's error times its stiffness is what inertia, damping, friction, and gravity take; divided
by the stiffness this is linear, and gravity, which the links' masses tell, gives the stiffness.
What the links' inertia says of it is that of the rotor again, but for what changes with the pose.
"""

import numpy as np
from scipy.signal import savgol_filter

from ident.dynamics.compiled_chain import torques
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.setup import MEMORY_S, MotionSegment, Setup
from ident.signals.arrays import Array

_SMOOTHED_S = 0.14
_SURE = 5.0  # standard errors of the load's coefficient from which it tells the stiffness
_ITS_OWN = 1e-3  # of the load, that nothing else in the regression could be
_WITHIN = 5.0  # of the joints' median, or of what the arm's file says
_REWEIGHED = 10
_TINY = 1e-12
_MOVING = 0.05  # of the fastest speed
_TURNING = {"turning_speed": 0.006, "presliding": 2e-4, "rise_speed": 1e-3}
"""Friction that turns round gradually leaves a fit smooth [rad, s]."""

_LEAST = 1e-3  # of the stiffness, for what came out negative


def neutral(n: int) -> Array:
    """Settings before any data, shape (quantities, n)."""
    return np.array([[q.first] * n for q in QUANTITIES])


def first_guess(setup: Setup, known: Array, *, same_servo: bool) -> Array:
    """Settings of an arm with linear servos and dry friction, shape (quantities, n).

    Args:
        setup: the recordings.
        known: settings from elsewhere, shape (quantities, n); NaN where nothing is known.
        same_servo: whether all joints have the same, so also the same stiffness.
    """
    parts = [smoothed(setup, s) for s in setup.segments]
    q, v, a, load = (np.concatenate(p) for p in zip(*parts, strict=True))
    n = q.shape[1]
    start = neutral(n)
    for name, value in _TURNING.items():
        start[ROW[name]] = value
    settings = np.where(np.isnan(known), start, known)
    betas, stiffness = np.zeros((5, n)), np.full(n, np.nan)
    for j in range(n):
        X, error = _rows(setup, j, settings[ROW["delay"], j], v[:, j], a[:, j], load[:, j])
        betas[:, j], weighed = _shares(X, error, setup.seconds / MEMORY_S)
        if weighed:
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


def unexplained(setup: Setup, joint: int, delay: float, zero: Array) -> tuple[float, bool]:
    """What a linear servo with dry friction leaves of its position errors, for some zeros.

    Args:
        setup: the recordings.
        joint: which joint, from 0.
        delay: of its commands [s].
        zero: of all joints, the model's position less the recorded one [rad], shape (n,).

    Returns:
        mean absolute rest [rad], and whether the errors surely grow with the joint's load.
    """
    parts = [smoothed(setup, s, zero) for s in setup.segments]
    _, v, a, load = (np.concatenate(p)[:, joint] for p in zip(*parts, strict=True))
    X, error = _rows(setup, joint, delay, v, a, load)
    shares, weighed = _shares(X, error, setup.seconds / MEMORY_S)
    calm = _calm(X)
    return float(np.average(np.abs(error - X @ shares), weights=calm)), weighed


def _rows(
    setup: Setup, joint: int, delay: float, v: Array, a: Array, load: Array
) -> tuple[Array, Array]:
    """What may explain a joint's position errors while it moves, shape (S, 5), and these errors."""
    moving = np.abs(v) > _MOVING * np.abs(v).max()
    X = np.column_stack([load, a, v, np.sign(v), np.ones(len(v))])
    return X[moving], _errors(setup, joint, delay)[moving]


def _calm(X: Array) -> Array:
    """Weights that are small at hard accelerations, shape (S,)."""
    hard = np.abs(X[:, 1])
    return np.minimum(np.median(hard) / np.maximum(hard, _TINY), 1.0) ** 2


def _shares(X: Array, error: Array, informed: float) -> tuple[Array, bool]:
    """What each column takes of the error, and whether the first one, the load, is sure of it.

    Least absolute errors, by weights, and hard accelerations count less: a servo at its limit or a
    joint at its stop is far from linear, and smoothing takes most from them. Neighbouring samples
    say the same, so that only so many count as are `informed`. Where the load is what the other
    columns could be as well, they get it: the load of a joint that lifts nothing is its link's
    inertia, which is a rotor's.
    """
    calm = _calm(X)
    shares, left = np.zeros(X.shape[1]), np.ones(len(error))
    spread, own = 1.0, X[:, 0]
    for _ in range(_REWEIGHED):
        usual = max(float(np.median(left)), _TINY)
        root = np.sqrt(calm * usual / np.maximum(left, usual))
        load, others, wanted = root * X[:, 0], root[:, None] * X[:, 1:], root * error
        own = load - others @ np.linalg.lstsq(others, load, rcond=None)[0]
        told = own @ own > _ITS_OWN**2 * (load @ load)
        shares[0] = own @ wanted / (own @ own) if told else 0.0
        shares[1:] = np.linalg.lstsq(others, wanted - shares[0] * load, rcond=None)[0]
        left = np.abs(error - X @ shares)
        spread = float(np.mean((root * left) ** 2))
    count = max(len(error) / informed, 1.0)
    sure = shares[0] > 0.0 and shares[0] ** 2 * (own @ own) > _SURE**2 * spread * count
    return shares, bool(sure)


def _errors(setup: Setup, joint: int, delay: float) -> Array:
    """What the command was ahead of the position, all segments stacked [rad], shape (S,)."""
    ahead = []
    for s in setup.segments:
        held = np.searchsorted(s.motion.stamp, s.motion.t - delay, side="right") - 1
        ahead.append(s.motion.command[np.maximum(held, 0), joint] - s.q[:, joint])
    return np.concatenate(ahead)


def smoothed(
    setup: Setup, segment: MotionSegment, zero: Array | float = 0.0
) -> tuple[Array, Array, Array, Array]:
    """Positions, speeds, accelerations [rad, s], and the links' load [N m], shape (S, n) each.

    `zero` is the model's position less the recorded one [rad], shape (n,).
    """
    period = float(np.median(np.diff(segment.motion.t)))
    count = len(segment.q)
    width = min(max(5, 2 * int(_SMOOTHED_S / period / 2) + 1), count - (1 - count % 2))
    q, v, a = (
        np.asarray(savgol_filter(segment.q, width, 3, deriv=d, delta=period, axis=0), order="C")
        for d in range(3)
    )
    load = torques(setup.chain, setup.delta, q + zero, v, a)
    return q, v, a, load
