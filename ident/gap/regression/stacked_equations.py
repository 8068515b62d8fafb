"""Normal equations of one model: inner products of its columns, in the order of its unknowns."""

from dataclasses import dataclass

import numpy as np

from ident.gap.regression.model_columns import JointColumns, ModelStructure, columns_on, sizes
from ident.gap.regression.normal_equations import NormalEquations
from ident.signals.arrays import Array


@dataclass(frozen=True)
class StackedEquations:
    """The inner products that a fit needs, by joint and noise region.

    Attributes:
        equations: of all columns, as one fold.
        structure: the model's columns.
        columns: the same on each joint.
        products: inner products, shape (n, regions, p, p).
        right: with the torque, shape (n, regions, p).
        squares: of the torque, shape (n, regions).
    """

    equations: NormalEquations
    structure: ModelStructure
    columns: tuple[JointColumns, ...]
    products: Array
    right: Array
    squares: Array

    def normal(self, weight: Array) -> tuple[Array, Array]:
        """Normal matrix, shape (p, p), and right-hand side for weights of shape (n, regions)."""
        p, w = self.right.shape[-1], weight.ravel()
        matrix = w @ self.products.reshape(len(w), p * p)
        return matrix.reshape(p, p), w @ self.right.reshape(len(w), p)

    def residual_squares(self, x: Array) -> Array:
        """Sums of squared residuals for unknowns of shape (p,), shape (n, regions)."""
        p = len(x)
        explained = (self.products.reshape(-1, p) @ x).reshape(-1, p) @ x
        return self.squares - 2 * (self.right @ x) + explained.reshape(self.squares.shape)

    def beside(self, structure: ModelStructure) -> "StackedEquations":
        """The same with one more effect; reversal curves may be others where it acts.

        Only what the new columns change is formed again.
        """
        p, effect = self.right.shape[-1], structure.effects[-1]
        size = p + effect.width
        shape = self.right.shape[:-1]
        products, right = np.zeros((*shape, size, size)), np.zeros((*shape, size))
        products[..., :p, :p], right[..., :p] = self.products, self.right
        columns = list(self.columns)
        others = (structure.shapes != self.structure.shapes).any(axis=1)
        for j in {*effect.joints, *np.flatnonzero(others).tolist()}:
            of_joint = self.equations.products[j][0]
            columns[j] = columns_on(self.equations, structure, j)
            if others[j]:
                products[j], right[j] = _in_order(columns[j], of_joint, size)
                continue
            first = self.equations.layouts[j].first_effect
            first += effect.starts[effect.joints.index(j)]
            own = np.arange(first, first + effect.width)
            here = self.columns[j]
            across = here.across(of_joint, own)
            products[j][:, here.unknown, p:] = across
            products[j][:, p:, here.unknown] = across.transpose(0, 2, 1)
            products[j][:, p:, p:] = of_joint[:, own[:, None], own]
            right[j][:, p:] = of_joint[:, own, -1]
        done = tuple(columns), products, right, self.squares
        return StackedEquations(self.equations, structure, *done)


def stacked(equations: NormalEquations, structure: ModelStructure) -> StackedEquations:
    """The inner products of a model's columns.

    Args:
        equations: of all columns, as one fold.
        structure: the model's columns.
    """
    size = sizes(equations, structure)[-1]
    columns = tuple(columns_on(equations, structure, j) for j in range(equations.dof))
    parts = [_in_order(c, p[0], size) for c, p in zip(columns, equations.products, strict=True)]
    products, right = (np.stack(x) for x in zip(*parts, strict=True))
    squares = np.array([p[0][:, -1, -1] for p in equations.products])
    return StackedEquations(equations, structure, columns, products, right, squares)


def _in_order(columns: JointColumns, products: Array, size: int) -> tuple[Array, Array]:
    """A joint's inner products, shape (regions, p, p), and with the torque, shape (regions, p)."""
    whole, right = np.zeros((len(products), size, size)), np.zeros((len(products), size))
    local, own = columns.local, columns.unknown
    inner = columns.mix.T @ products[:, local[:, None], local] @ columns.mix
    whole[:, own[:, None], own], right[:, own] = inner, products[:, local, -1] @ columns.mix
    return whole, right
