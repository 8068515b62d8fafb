"""Further columns on one joint, with what the model absorbs of them projected off."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.regression.design_matrix import Table
from ident.gap.regression.weighted_fit import Fit, places, solve

Array = NDArray[np.floating]

_RIDGE = 1e-6
_SEEN = 1e-5  # of the columns' own squares: what is left of a direction after projection


@dataclass(frozen=True)
class JointRows:
    """Residuals and model columns of some rows of a joint, in units of their noise.

    Attributes:
        chosen: which rows, shape (R,).
        sigma: their noise [N m], shape (m,).
        nominal: the model's columns, shape (m, k).
        unknown: which of the model's unknowns multiplies each, shape (k,).
        error: residual, shape (m,).
    """

    chosen: NDArray[np.bool_]
    sigma: Array
    windowed_rows: Array
    unknown: NDArray[np.int64]
    error: Array

    def scaled(self, columns: Array) -> Array:
        """Other columns of all rows, shape (R, c), in these rows and units, shape (m, c)."""
        return columns[self.chosen] / self.sigma[:, None]


def joint_rows(
    table: Table, now: Fit, joint: int, chosen: NDArray[np.bool_], residual: Array
) -> JointRows:
    """Some rows of a joint.

    Args:
        table: all rows.
        now: the present fit.
        joint: from 0.
        chosen: which rows, shape (R,).
        residual: of all rows [N m], shape (R,).
    """
    place = places(table.grams, now.choice)[joint]
    sigma = now.sigma[joint][table.region[chosen, joint]]
    windowed_rows = place.of(table.columns[joint][chosen]) / sigma[:, None]
    return JointRows(chosen, sigma, windowed_rows, place.unknown, residual[chosen] / sigma)


@dataclass(frozen=True)
class Fitted:
    """Coefficients of some columns, half the drop of the squares, and the best pair's place."""

    values: Array
    gain: float
    place: int = 0


@dataclass(frozen=True)
class Projected:
    """Columns beside a model.

    Attributes:
        scaled: in units of the noise, shape (m, c).
        absorbed: what the model takes up of each, by its columns, shape (k, c).
        products: inner products of what it leaves, shape (c, c).
    """

    scaled: Array
    absorbed: Array
    products: Array

    def fitted(self, error: Array, single: bool = False) -> Fitted:
        """The coefficients that explain most of a residual, shape (m,).

        Args:
            error: in units of the noise.
            single: whether the best of several pairs of columns counts, not all together.
        """
        scale = np.sqrt(np.maximum((self.scaled**2).sum(axis=0), 1e-300))
        products = self.products / scale[:, None] / scale + _RIDGE * np.eye(len(scale))
        right = (self.scaled.T @ error) / scale
        if not single:
            lengths, axes = np.linalg.eigh(products)
            seen = axes[:, lengths > _SEEN]  # the rest is in the model already
            values = seen @ ((seen.T @ right) / lengths[lengths > _SEEN])
            return Fitted(values / scale, float(right @ values) / 2)
        blocks = np.stack([products[i : i + 2, i : i + 2] for i in range(0, len(scale), 2)])
        rights = right.reshape(-1, 2)
        values = np.linalg.solve(blocks, rights[..., None])[..., 0]
        gains = np.einsum("wi,wi->w", rights, values) / 2
        best = int(gains.argmax())
        chosen = np.zeros(len(scale))
        chosen[2 * best : 2 * best + 2] = values[best]
        return Fitted(chosen / scale, float(gains[best]), best)


def projected(now: Fit, rows: JointRows, columns: Array) -> Projected:
    """Columns of all rows, shape (R, c), beside the present model."""
    scaled = rows.scaled(columns)
    across = np.zeros((len(now.normal), scaled.shape[1]))
    across[rows.unknown] = rows.windowed_rows.T @ scaled
    back = solve(now.normal, across)
    return Projected(scaled, back[rows.unknown], scaled.T @ scaled - across.T @ back)
