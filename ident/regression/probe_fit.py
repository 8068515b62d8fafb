"""Least squares on a probe, and its error on what was left out."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ident.dynamics.parameters import Terms, standard_parameters
from ident.dynamics.regressor import smooth_columns
from ident.regression.probe import Probe
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot

FOLDS = 3
_STRETCHES = 12
_RIDGE = 1e-6
"""Added to the normal equations of columns of length one, so that what the data leave open is 0."""

_ROUNDING = 1e-20
"""Columns whose square is less than this beside the largest hold rounding errors only."""


@dataclass(frozen=True)
class Columns:
    """The regression of a probe, joint by joint; rows of joints that are held are zero.

    Attributes:
        W: columns of links, friction, and offset, shape (S, n, p).
        friction: places of the viscous and Coulomb columns of each joint, shape (n, 2).
        tau: torque [N m], shape (S, n).
        fold: which fold each instant is held out in, shape (S,).
    """

    W: Array
    friction: NDArray[np.intp]
    tau: Array
    fold: NDArray[np.intp]

    @cached_property
    def squares(self) -> Array:
        """W^T W of each fold and joint, shape (FOLDS, n, p, p): whatever the torque and weights."""
        folds = [self.W[self.fold == k].transpose(1, 0, 2) for k in range(FOLDS)]
        return np.array([rows.transpose(0, 2, 1) @ rows for rows in folds])

    def with_torque(self, tau: Array) -> "Columns":
        """The same motion with other torque [N m], shape (S, n)."""
        found = replace(self, tau=tau)
        found.__dict__["squares"] = self.squares
        return found


def columns_of(robot: Robot, terms: Terms, probe: Probe, springs: bool = False) -> Columns:
    """The regression of a probe: the rigid body with friction and offset.

    Args:
        robot: kinematics, frames, and gravity.
        terms: how motors and joints are coupled.
        probe: the samples.
        springs: whether each joint has a spring, too.
    """
    n = robot.dof
    body = Terms(False, False, False, True, terms.drive_matrix, False)
    parameters = standard_parameters(robot, body)
    links = smooth_columns(robot, body, probe.motion, parameters)
    own = np.eye(n)
    signals = [probe.motion.qd, probe.sign, np.ones_like(probe.sign)]
    drives = [x[:, :, None] * own for x in [*signals, *([probe.motion.q] if springs else [])]]
    coupled = [m - 1 for m in terms.coupled_motors] if terms.motor_friction else []
    rows = terms.drive_matrix[coupled]
    shared = [(x @ rows.T)[:, None, :] * rows.T for x in (probe.motion.qd, probe.sign) if len(rows)]
    W = np.concatenate([links, *drives, *shared], axis=2)
    W[~probe.counted] = 0.0
    first = links.shape[2]
    friction = first + np.column_stack([np.arange(n), n + np.arange(n)])
    tau = np.where(probe.counted, probe.tau, 0.0)
    return Columns(W, friction, tau, _folds(probe))


def _folds(probe: Probe) -> NDArray[np.intp]:
    """Every third stretch of each recording together."""
    fold = np.zeros(len(probe.t), dtype=np.intp)
    for log in np.unique(probe.log):
        places = np.flatnonzero(probe.log == log)
        fold[places] = (np.arange(len(places)) * _STRETCHES // max(len(places), 1)) % FOLDS
    return fold


def weights_of(tau: Array) -> Array:
    """Weights under which every joint's torque is of size one, shape (n,)."""
    size = np.sqrt(np.mean(tau**2, axis=0))
    return np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)


def solution(A: Array, y: Array) -> Array:
    """Least squares by normal equations, with zero for what the data leave open.

    Args:
        A: W^T W, shape (p, p).
        y: W^T tau, shape (p,) or (p, c).
    """
    scaled, scale = _scaled(A)
    return (scale * np.linalg.solve(scaled, (scale * y.T).T).T).T


def _scaled(A: Array) -> tuple[Array, Array]:
    """Normal equations of columns of length one, with the ridge, and what scales the columns."""
    square = np.diag(A)
    seen = square > _ROUNDING * square.max()
    scale = np.divide(1.0, np.sqrt(square), out=np.zeros_like(square), where=seen)
    return A * np.outer(scale, scale) + _RIDGE * np.eye(len(A)), scale


def held_out_residual(columns: Columns, weights: Array | None = None) -> Array:
    """What remains of the torque where it was not fitted [N m], shape (S, n).

    Args:
        columns: the regression.
        weights: of the joints' rows, shape (n,); None: every joint's torque counts alike.
    """
    w = weights_of(columns.tau) if weights is None else weights
    return held_out_residuals(columns, columns.tau[None], w)[0]


def held_out_residuals(columns: Columns, taus: Array, weights: Array) -> Array:
    """What remains of several torques along one motion where they were not fitted.

    Args:
        columns: the regression; its own torque takes no part.
        taus: the torques [N m], shape (D, S, n).
        weights: of the joints' rows, shape (n,).

    Returns:
        Residuals [N m], shape (D, S, n).
    """
    grams = np.tensordot(weights**2, columns.squares, axes=(0, 1))
    parts = [columns.fold == k for k in range(FOLDS)]
    rows = [columns.W[part].reshape(-1, columns.W.shape[-1]) for part in parts]
    goals = [(taus[:, part] * weights**2).reshape(len(taus), -1).T for part in parts]
    sides = np.array([w.T @ goal for w, goal in zip(rows, goals, strict=True)])
    result = taus.copy()
    for k, part in enumerate(parts):
        beta = solution(grams.sum(axis=0) - grams[k], sides.sum(axis=0) - sides[k])
        result[:, part] -= (rows[k] @ beta).T.reshape(len(taus), -1, taus.shape[2])
    return result


def bounded_residual(columns: Columns, not_negative: NDArray[np.intp]) -> Array:
    """What remains of the torque where it was not fitted, with some parameters bounded [N m].

    Args:
        columns: the regression.
        not_negative: places of the parameters that may not be below zero.

    Returns:
        Residual, shape (S, n).
    """
    w, result = weights_of(columns.tau), columns.tau.copy()
    lower = np.full(columns.W.shape[2], -np.inf)
    lower[not_negative] = 0.0
    grams = np.tensordot(w**2, columns.squares, axes=(0, 1))
    for k in range(FOLDS):
        rest, part = columns.fold != k, columns.fold == k
        A, scale = _scaled(grams.sum(axis=0) - grams[k])
        y = columns.W[rest].reshape(-1, len(A)).T @ (w**2 * columns.tau[rest]).ravel()
        root = np.linalg.cholesky(A)
        beta = lsq_linear(root.T, np.linalg.solve(root, scale * y), bounds=(lower, np.inf)).x
        result[part] -= columns.W[part] @ (scale * beta)
    return result


def gram(W: Array, tau: Array) -> tuple[Array, Array]:
    """Normal equations of rows of any shape (.., c) and their goals: shapes (c, c) and (c,)."""
    rows = W.reshape(-1, W.shape[-1])
    return rows.T @ rows, rows.T @ tau.ravel()


def shares(residual: Array, tau: Array) -> Array:
    """Relative error of each joint, shape (n,); zero for joints without torque."""
    size = np.sum(tau**2, axis=0)
    return np.sqrt(
        np.divide(np.sum(residual**2, axis=0), size, out=np.zeros(len(size)), where=size > 0)
    )


def fitted_residual(columns: Columns) -> Array:
    """What a fit in which all joints count alike leaves of its own torque [N m], shape (S, n)."""
    w = weights_of(columns.tau)
    A = np.tensordot(w**2, columns.squares.sum(axis=0), axes=(0, 0))
    goal = (w**2 * columns.tau).ravel()
    return columns.tau - columns.W @ solution(A, columns.W.reshape(-1, len(A)).T @ goal)


def error_of(columns: Columns, residual: Array) -> float:
    """Relative error, the mean of the squares over the joints, square root of it.

    Of a joint that is predicted worse than by no torque at all it does not matter how much worse.

    Args:
        columns: the regression.
        residual: what is left of its torque [N m], shape (S, n).
    """
    found = np.minimum(shares(residual, columns.tau), 1.0)
    used = np.any(columns.W != 0, axis=(0, 2))
    return float(np.sqrt(np.mean(found[used] ** 2))) if used.any() else 0.0
