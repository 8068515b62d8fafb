"""Along which curves each joint's friction turns round, and how much rows near a reversal count.

Both are chosen from inner products, in turn with the parameters: the mixture of curves that leaves
the least, all else projected off, and the size of the residual in each region of distance from a
reversal. Rows that fit worse than those far from reversals count less, in proportion to their
variance; joints keep their weights relative to each other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.reversal_friction import SmoothedSign, best_mixture, curve_of, parts_of
from ident.effects.smoothed_segment import DIRECTION_HZ
from ident.model.fit_filter import ReversalPart
from ident.regression.filters import CURVES
from ident.regression.reduction import Reversals
from ident.regression.reversal_columns import REGIONS
from ident.signals.arrays import Array

_ROUNDS = 6
_SETTLED = 1e-3  # change of a part of a mixture, or of a weight
_ABSORBED = 1e-6  # of a curve's own square: what is left is rounding
_RIDGE = 1e-12
_ROUNDING = 1e-4  # of the torque's rms: no smaller residual is believed
_ENOUGH = 1 / 8  # of a joint's rows: fewer do not say how well the model can fit
_USUAL = np.array([float(c.cutoff == 1 and c.scale == 0.0065) for c in CURVES])
_ALL = np.ones(len(CURVES), dtype=bool)
_NO_TAILS = np.array([not curve.tailed for curve in CURVES])
_NO_DISTANCE = np.array([curve.cutoff is not None for curve in CURVES])


@dataclass(frozen=True)
class KnownShapes:
    """How friction turns round, as a model says.

    Attributes:
        curves: T of them.
        shapes: parts of the curves in each joint's friction, shape (n, T).
    """

    curves: tuple[SmoothedSign, ...]
    shapes: Array

    @classmethod
    def of_model(cls, reversals: Sequence[Sequence[ReversalPart]]) -> "KnownShapes":
        """What a model keeps of each joint."""
        named = [[(curve_of(p), p.part) for p in joint] for joint in reversals]
        curves = tuple(dict.fromkeys(curve for joint in named for curve, _ in joint))
        shapes = np.zeros((len(named), len(curves)))
        for row, joint in zip(shapes, named, strict=True):
            for curve, part in joint:
                row[curves.index(curve)] += part
        return cls(curves, shapes)

    def for_model(self) -> tuple[tuple[ReversalPart, ...], ...]:
        """The same as a model keeps it."""
        return tuple(
            tuple(_part(c, float(x)) for c, x in zip(self.curves, row, strict=True) if x > 0.0)
            for row in self.shapes
        )


def _part(curve: SmoothedSign, part: float) -> ReversalPart:
    cutoff = None if curve.cutoff is None else DIRECTION_HZ[curve.cutoff]
    return ReversalPart(part, curve.scale, cutoff, curve.tailed)


@dataclass(frozen=True)
class WideProducts:
    """Inner products of [W | curves | tau] of all recordings.

    Attributes:
        of: shape (n, REGIONS, c, c).
        rows: number of rows, shape (n, REGIONS).
        places: column of each joint's Coulomb friction in W, shape (n,); -1 where it has none.
    """

    of: Array
    rows: NDArray[np.int64]
    places: NDArray[np.int64]

    @property
    def base(self) -> int:
        """Number of base parameters b."""
        return self.of.shape[-1] - len(CURVES) - 1

    @property
    def curved(self) -> list[int]:
        """Joints whose curves are to be chosen."""
        moves = self.rows.sum(axis=1) > 0
        return [j for j, place in enumerate(self.places) if place >= 0 and moves[j]]


def at_once(places: NDArray[np.int64]) -> Reversals:
    """Friction that changes its sign at once, and rows that all count alike."""
    n = len(places)
    return Reversals(places, np.zeros((n, 0)), np.ones((n, REGIONS)))


def chosen_reversals(products: WideProducts, allowed: NDArray[np.bool_] = _ALL) -> Reversals:
    """Curves and weights that agree with the parameters that they lead to.

    Args:
        products: of all rows.
        allowed: which curves may be used, shape (T,).
    """
    n = len(products.places)
    now = Reversals(products.places, np.tile(_USUAL, (n, 1)), np.ones((n, REGIONS)))
    for _ in range(_ROUNDS):
        shapes = _best_shapes(products, now, allowed)
        after = replace(now, shapes=shapes)
        after = replace(after, weights=_weights(products, after))
        moved = max(
            np.abs(after.shapes - now.shapes).max(), np.abs(after.weights - now.weights).max()
        )
        now = after
        if moved < _SETTLED:
            break
    return now


def other_solutions(products: WideProducts) -> Iterator[Array]:
    """Base parameters with fewer kinds of curves to choose from, each of shape (b,)."""
    for allowed in (_NO_TAILS, _NO_DISTANCE):
        yield least_squares_with(products, chosen_reversals(products, allowed))


def least_squares_with(products: WideProducts, reversals: Reversals) -> Array:
    """Base parameters by weighted least squares, shape (b,)."""
    total = _mixed(products, reversals).sum(axis=0)
    return _solved(total[:-1, :-1], total[:-1, -1])


def _weighted(products: WideProducts, reversals: Reversals) -> Array:
    """Inner products of each joint's weighted rows, shape (n, c, c)."""
    return np.einsum("jr,jrpq->jpq", reversals.weights, products.of)


def _mixers(products: WideProducts, reversals: Reversals) -> Array:
    """Matrices that mix the curves of each joint, shape (n, c, b + 1)."""
    b = products.base
    M = np.zeros((len(products.places), products.of.shape[-1], b + 1))
    M[:, np.arange(b), np.arange(b)] = 1.0
    M[:, -1, -1] = 1.0
    for j, place in enumerate(products.places):
        if place >= 0:
            M[j, place, place] = 0.0
            M[j, b:-1, place] = reversals.shapes[j]
    return M


def _mixed(products: WideProducts, reversals: Reversals) -> Array:
    """Inner products of each joint's weighted rows [W | tau], shape (n, b + 1, b + 1)."""
    M = _mixers(products, reversals)
    return np.swapaxes(M, 1, 2) @ _weighted(products, reversals) @ M


def _best_shapes(products: WideProducts, now: Reversals, allowed: NDArray[np.bool_]) -> Array:
    b = products.base
    wide, total = _weighted(products, now), _mixed(products, now).sum(axis=0)
    shapes = now.shapes.copy()
    for j in products.curved:
        others = np.arange(b) != products.places[j]
        across = wide[j][:b, b:-1][others]
        right = total[:b, b][others]
        absorbed = _solved(total[:b, :b][np.ix_(others, others)], np.column_stack([across, right]))
        own = wide[j][b:-1, b:-1]
        left = own - across.T @ absorbed[:, :-1]
        torque = wide[j][b:-1, -1] - across.T @ absorbed[:, -1]
        out = (np.diag(left) <= _ABSORBED * np.diag(own)) | ~allowed
        left[out], left[:, out], torque[out] = 0.0, 0.0, 0.0
        shapes[j] = parts_of(best_mixture(left, torque)[0], shapes[j])
    return shapes


def _weights(products: WideProducts, now: Reversals) -> Array:
    """Weights of each joint's regions, one where the residual is as small as anywhere."""
    beta = least_squares_with(products, now)
    v = _mixers(products, now) @ np.append(-beta, 1.0)
    squares = np.einsum("jp,jrpq,jq->jr", v, products.of, v)
    torque = products.of[..., -1, -1].sum(axis=1) / np.maximum(products.rows.sum(axis=1), 1)
    variance = np.maximum(squares / np.maximum(products.rows, 1), 0.0)
    variance = np.maximum(variance, _ROUNDING**2 * torque[:, None])
    enough = products.rows >= _ENOUGH * products.rows.sum(axis=1, keepdims=True)
    least = np.where(enough, variance, np.inf).min(axis=1, keepdims=True)
    known = (products.rows > 0) & (variance > 0.0)
    return np.where(known, np.minimum(1.0, least / np.where(known, variance, 1.0)), 1.0)


def _solved(normal: Array, right: Array) -> Array:
    """Solution of normal equations, columns in their own scale."""
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    matrix = normal / scale[:, None] / scale + _RIDGE * np.eye(len(scale))
    return (np.linalg.solve(matrix, (right.T / scale).T).T / scale).T
