"""What the run page draws of the model: friction over speed, and how parameters hang together."""

from dataclasses import dataclass

import numpy as np

from ident.identification.identify import Identification
from ident.identification.standard_errors import QUANTILE_90
from ident.signals.arrays import Array

_BINS = 14  # of measured points, in each direction
_LEAST_ROWS = 40  # in each direction: fewer make no curve


@dataclass(frozen=True)
class FrictionCurve:
    """Friction of one joint over its speed.

    Attributes:
        joint: from 0.
        speed: mean speed of each bin [rad/s], ascending, with zero between them, shape (B,).
        measured: mean torque that the rest of the model leaves [N m], shape (B,).
        model: [N m], shape (B,).
        half_width: of the model's 90 % interval [N m], shape (B,).
    """

    joint: int
    speed: Array
    measured: Array
    model: Array
    half_width: Array


def correlation(found: Identification) -> Array:
    """Correlation of the least-squares base parameters, shape (b, b)."""
    R = found.evidence.problem().R[:-1, :-1]
    scaled = R / np.linalg.norm(R, axis=0)
    inverse = np.linalg.solve(scaled, np.eye(len(scaled)))
    covariance = inverse @ inverse.T
    size = np.sqrt(np.diag(covariance))
    return covariance / np.outer(size, size)


def friction_curves(found: Identification, correlated: Array) -> tuple[FrictionCurve, ...]:
    """Friction of every joint that moves and has some.

    Args:
        found: the identification.
        correlated: correlation of the base parameters, shape (b, b).
    """
    curves = []
    for j in np.flatnonzero(found.evidence.moving).tolist():
        curve = _curve(found, correlated, j)
        if curve is not None:
            curves.append(curve)
    return tuple(curves)


def _curve(found: Identification, correlated: Array, joint: int) -> FrictionCurve | None:
    kept = found.evidence.base.kept_parameters
    of = {"fv": lambda v: v, "fc": np.sign, "fo": np.ones_like}
    own = [i for i, p in enumerate(kept) if p.index == joint + 1 and p.kind in of]
    speed, left = _left(found, joint, own)
    if not own or min((speed > 0).sum(), (speed < 0).sum()) < _LEAST_ROWS:
        return None
    x, measured = _binned(speed, left)
    columns = np.array([of[kept[i].kind](x) for i in own])
    covariance = correlated[np.ix_(own, own)] * np.outer(found.sd[own], found.sd[own])
    sd = np.sqrt(np.einsum("ib,ij,jb->b", columns, covariance, columns))
    model = found.estimates[found.chosen].beta[own] @ columns
    measured[x == 0.0] = np.nan
    return FrictionCurve(joint, x, measured, model, QUANTILE_90 * sd)


def _left(found: Identification, joint: int, own: list[int]) -> tuple[Array, Array]:
    """Speed, and torque without what the model has beside the joint's friction, shape (S,)."""
    beta = found.estimates[found.chosen].beta.copy()
    beta[own] = 0.0
    parts = [log.reduction.excerpt for log in found.evidence.logs]
    speed = np.concatenate([p.speed[:, joint] for p in parts])
    left = np.concatenate([p.tau[:, joint] - p.W[:, joint] @ beta for p in parts])
    return speed, left


def _binned(speed: Array, left: Array) -> tuple[Array, Array]:
    """Means over equally filled bins in each direction, with a gap at standstill."""
    x, y = [np.zeros(1)], [np.zeros(1)]
    for side in (speed < 0, speed > 0):
        order = np.argsort(speed[side])
        x.append(np.array([s.mean() for s in np.array_split(speed[side][order], _BINS)]))
        y.append(np.array([s.mean() for s in np.array_split(left[side][order], _BINS)]))
    order = np.argsort(np.concatenate(x))
    return np.concatenate(x)[order], np.concatenate(y)[order]
