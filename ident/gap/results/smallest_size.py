"""The size from which an effect beside a model could be named, by each thing that a name asks for.

With the model projected off its columns (Frisch-Waugh-Lovell), an effect's own columns tell the
gain and the standard error that a size of it would have.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.projection import SEEN, JointRows, joint_rows, project_off
from ident.gap.regression.residuals import residuals
from ident.gap.regression.sandwich import block_sums, sandwich
from ident.gap.regression.weighted_fit import Fit, fit
from ident.gap.settings import Naming
from ident.signals.arrays import Array

_MOST_GAIN = 300.0  # nats: more overflows


@dataclass(frozen=True)
class BesideModel:
    """A model with all its effects on some rows, and candidates beside it.

    Attributes:
        design: columns of all effects and candidates.
        fit: of the model to these rows.
        chosen: which rows, shape (R,).
        rows: their residuals and model columns, by joint that moves.
    """

    design: DesignMatrix
    fit: Fit
    chosen: NDArray[np.bool_]
    rows: dict[int, JointRows]

    def beside(self, index: int) -> "BesideColumns | None":
        """A candidate's columns beside the model; None if that stands for one of them."""
        felt = [j for j in self.design.index[index].joints if j in self.rows]
        own = {j: self.rows[j].scaled(self.design.effect_columns(index, j)) for j in felt}
        width = self.design.index[index].width
        raw, across = np.zeros((width, width)), np.zeros((len(self.fit.normal), width))
        for j, columns in own.items():
            raw += columns.T @ columns
            across[self.rows[j].unknown] += self.rows[j].model.T @ columns
        left, absorbed = project_off(self.fit.normal, across, raw)
        if (np.diag(left) <= SEEN * np.diag(raw)).any():
            return None
        weights = without_others(left)
        kept = float(weights @ left[0])
        if kept <= SEEN * raw[0, 0]:
            return None
        counts = self.fit.counts[list(self.design.effects[index].rows)].sum(axis=1)
        return BesideColumns(self, own, absorbed, left, weights / kept, kept / max(counts.max(), 1))


def model_on(design: DesignMatrix, model: Fit, folds: Sequence[int]) -> BesideModel:
    """A model on the rows of some folds.

    Args:
        design: columns of all effects and candidates.
        model: a fit of the same structure.
        folds: which of them.
    """
    now = fit(design.equations.of(folds), model.structure, model.sigma)
    chosen = np.isin(design.fold, list(folds))
    left = residuals(design, now)
    rows = {
        j: joint_rows(design, now, j, chosen, r.values)
        for j, r in enumerate(left)
        if len(r.values) > 0
    }
    return BesideModel(design, now, chosen, rows)


@dataclass(frozen=True)
class BesideColumns:
    """A candidate's columns beside a model.

    Attributes:
        model: what they stand beside.
        own: the columns in units of the noise, shape (m, k), by joint.
        absorbed: coefficients of the model's columns that stand for them, shape (p, k).
        left: inner products without what the model absorbs, shape (k, k).
        first: weights of their inner products with the torque whose sum is the first coefficient,
            shape (k,).
        square: of the first column, without the model and the others, per row and unit.
    """

    model: BesideModel
    own: dict[int, Array]
    absorbed: Array
    left: Array
    first: Array
    square: float

    def size_of_gain(self, gain: float) -> float:
        """First coefficient of an effect that gains so much [nats per sample]."""
        return float(np.sqrt((np.exp(2 * min(gain, _MOST_GAIN)) - 1) / self.square))

    def size_of_torque(self, index: int, asked: Naming, resolution: Array) -> float:
        """First coefficient whose torque is seen, and is no trifle beside friction.

        Args:
            index: of the candidate.
            asked: of a name.
            resolution: largest rounding error of the torque [N m], shape (n,).
        """
        design, friction = self.model.design, np.abs(self.model.fit.coulomb)
        highest = {j: np.abs(design.effect_columns(index, j)[:, 0]).max() for j in self.own}
        j = max(highest, key=lambda j: highest[j])
        share = min(
            asked.min_friction_share * friction[j] / highest[j],
            asked.min_residual_share / np.sqrt(self.square),
        )
        return float(max(resolution[j] / highest[j], share))

    def standard_error(self, labels: Sequence[NDArray[np.int64]]) -> float:
        """Cluster-robust standard error of the first coefficient, with the effect in the model.

        Args:
            labels: ways of taking blocks of time as independent: the block of each row, shape (R,).
        """
        rows, chosen = self.model.rows, self.model.chosen
        beside = {j: -r.model @ self.absorbed[r.unknown] for j, r in rows.items()}
        beside |= {j: beside[j] + columns for j, columns in self.own.items()}
        right = sum(c.T @ rows[j].error for j, c in beside.items())
        values = np.linalg.lstsq(self.left, right)[0]
        scores = {j: (c @ self.first) * (rows[j].error - c @ values) for j, c in beside.items()}
        score = np.sum(list(scores.values()), axis=0)
        count = 1 + max(int(label.max()) for label in labels)
        freedom = len(self.model.fit.x) / len(rows)
        sums = [block_sums(score[:, None], label[chosen], count) for label in labels]
        return float(np.sqrt(max(sandwich(s, np.ones((1, 1)), freedom)[0] for s in sums)))


def without_others(products: Array) -> Array:
    """Weights of columns whose sum is the first one without what the others explain of it, (k,).

    Args:
        products: of k columns, shape (k, k); held joints leave some of them alike.
    """
    others = np.linalg.lstsq(products[1:, 1:], products[1:, 0])[0]
    return np.concatenate([[1.0], -others])
