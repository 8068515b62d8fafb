"""Columns with everything that the model can absorb of them projected off (Frisch-Waugh-Lovell)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.model_columns import joint_columns
from ident.gap.regression.weighted_fit import Fit, solve
from ident.signals.arrays import Array

_RIDGE = 1e-6

SEEN = 1e-5
"""Of the columns' own squares: smaller directions are in the model already."""


def project_off(normal: Array, across: Array, own: Array) -> tuple[Array, Array]:
    """Inner products of columns after the model is projected off, and what it absorbs of them.

    Args:
        normal: inner products of the model's columns, shape (p, p).
        across: of the model's columns with others, shape (p, c).
        own: of the others, shape (c, c).

    Returns:
        the Schur complement own - across' normal^-1 across, shape (c, c), and normal^-1 across.
    """
    absorbed = solve(normal, across)
    return own - across.T @ absorbed, absorbed


def project_off_with_torque(
    normal: Array, across: Array, own: Array, right: tuple[Array, Array]
) -> tuple[Array, Array]:
    """The same for the columns, shape (c, c), and for their products with the torque, shape (c,).

    Args:
        normal: inner products of the model's columns, shape (p, p).
        across: of the model's columns with others, shape (p, c).
        own: of the others, shape (c, c).
        right: of the model's columns, shape (p,), and of the others, shape (c,), with the torque.
    """
    absorbed = solve(normal, np.column_stack([across, right[0]]))
    return own - across.T @ absorbed[:, :-1], right[1] - across.T @ absorbed[:, -1]


@dataclass(frozen=True)
class JointRows:
    """Residuals and model columns of some rows of a joint, in units of their noise.

    Attributes:
        chosen: which rows, shape (R,).
        sigma: their noise [N m], shape (m,).
        model: the model's columns, shape (m, k).
        unknown: index of the unknown that multiplies each, shape (k,).
        error: residual, shape (m,).
    """

    chosen: NDArray[np.bool_]
    sigma: Array
    model: Array
    unknown: NDArray[np.int64]
    error: Array

    def scaled(self, columns: Array) -> Array:
        """Other columns of all rows, shape (R, c), in these rows and units, shape (m, c)."""
        return columns[self.chosen] / self.sigma[:, None]


def joint_rows(
    design: DesignMatrix, now: Fit, joint: int, chosen: NDArray[np.bool_], residual: Array
) -> JointRows:
    """Some rows of a joint.

    Args:
        design: all rows.
        now: the current fit.
        joint: from 0.
        chosen: which rows, shape (R,).
        residual: of all rows [N m], shape (R,).
    """
    model = joint_columns(design.equations, now.structure)[joint]
    sigma = now.sigma[joint][design.region[chosen, joint]]
    columns = model.of(design.columns[joint][chosen]) / sigma[:, None]
    return JointRows(chosen, sigma, columns, model.unknown, residual[chosen] / sigma)


@dataclass(frozen=True)
class Fitted:
    """Coefficients of columns, and half the drop of the squares."""

    values: Array
    gain: float


@dataclass(frozen=True)
class Projected:
    """Columns beside a model.

    Attributes:
        scaled: in units of the noise, shape (m, c).
        absorbed: coefficients of the model's columns that stand for them, shape (k, c).
        products: inner products after projection, shape (c, c).
    """

    scaled: Array
    absorbed: Array
    products: Array

    def fitted(self, error: Array, single: bool = False) -> Fitted:
        """The coefficients that explain most of a residual, shape (m,).

        Args:
            error: in units of the noise.
            single: use the best pair of columns only, not all together.
        """
        scale = np.sqrt(np.maximum((self.scaled**2).sum(axis=0), 1e-300))
        products = self.products / scale[:, None] / scale + _RIDGE * np.eye(len(scale))
        right = (self.scaled.T @ error) / scale
        if not single:
            lengths, axes = np.linalg.eigh(products)
            seen = axes[:, lengths > SEEN]
            values = seen @ ((seen.T @ right) / lengths[lengths > SEEN])
            return Fitted(values / scale, float(right @ values) / 2)
        blocks = np.stack([products[i : i + 2, i : i + 2] for i in range(0, len(scale), 2)])
        rights = right.reshape(-1, 2)
        values = np.linalg.solve(blocks, rights[..., None])[..., 0]
        gains = np.einsum("wi,wi->w", rights, values) / 2
        best = int(gains.argmax())
        chosen = np.zeros(len(scale))
        chosen[2 * best : 2 * best + 2] = values[best]
        return Fitted(chosen / scale, float(gains[best]))


def projected(now: Fit, rows: JointRows, columns: Array) -> Projected:
    """Columns of all rows, shape (R, c), beside the current model."""
    scaled = rows.scaled(columns)
    across = np.zeros((len(now.normal), scaled.shape[1]))
    across[rows.unknown] = rows.model.T @ scaled
    left, absorbed = project_off(now.normal, across, scaled.T @ scaled)
    return Projected(scaled, absorbed[rows.unknown], left)
