"""Which columns a model has, and which unknown multiplies each."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.regression.normal_equations import NormalEquations
from ident.signals.arrays import Array


@dataclass(frozen=True)
class ColumnIndex:
    """Position of one effect's columns.

    Attributes:
        joints: the joints whose torque the effect changes, from 0.
        starts: first column on each of those joints, counted from `Layout.first_effect`.
        width: number of coefficients.
    """

    joints: tuple[int, ...]
    starts: tuple[int, ...]
    width: int


@dataclass(frozen=True)
class ModelStructure:
    """Which columns a model has.

    Attributes:
        shapes: share of each reversal curve in each joint's friction, shape (n, T).
        effects: columns of the effects in the model.
    """

    shapes: Array
    effects: tuple[ColumnIndex, ...] = ()

    def with_shape(self, joint: int, shape: Array) -> "ModelStructure":
        """The same with other reversal curves of one joint."""
        shapes = self.shapes.copy()
        shapes[joint] = shape
        return ModelStructure(shapes, self.effects)

    def with_effect(self, effect: ColumnIndex) -> "ModelStructure":
        """The same with one more effect."""
        return ModelStructure(self.shapes, (*self.effects, effect))


@dataclass(frozen=True)
class JointColumns:
    """A model's columns on one joint.

    Attributes:
        local: the joint's columns that they are made of, shape (l,).
        mix: their weights, shape (l, k): reversal curves are mixed to one column, all other columns
            are taken as they are.
        unknown: index of the unknown that multiplies each, shape (k,).
    """

    local: NDArray[np.int64]
    mix: Array
    unknown: NDArray[np.int64]

    def of(self, columns: Array) -> Array:
        """The model's columns, shape (R, k), from all columns, shape (R, p)."""
        return columns[:, self.local] @ self.mix

    def across(self, products: Array, others: NDArray[np.int64]) -> Array:
        """Inner products of the model's columns with others, shape (..., k, m)."""
        return self.mix.T @ products[..., self.local[:, None], others]


def without_effect(
    equations: NormalEquations, effect: ColumnIndex, values: Array
) -> NormalEquations:
    """The same with an effect of known size taken off the torque.

    Args:
        equations: of all columns.
        effect: its columns.
        values: its coefficients, shape (k,).
    """
    products = list(equations.products)
    for j, start in zip(effect.joints, effect.starts, strict=True):
        first = equations.layouts[j].first_effect + start
        own, here = slice(first, first + effect.width), products[j].copy()
        here[..., -1] -= here[..., own] @ values
        here[..., -1, :] -= values @ here[..., own, :]
        products[j] = here
    return replace(equations, products=tuple(products))


def sizes(equations: NormalEquations, structure: ModelStructure) -> NDArray[np.int64]:
    """First unknown of each effect, and the number of all unknowns."""
    widths = [e.width for e in structure.effects]
    return equations.base + 2 * equations.dof + np.cumsum([0, *widths])


def joint_columns(equations: NormalEquations, structure: ModelStructure) -> list[JointColumns]:
    """The model's columns on each joint."""
    return [columns_on(equations, structure, j) for j in range(equations.dof)]


def columns_on(equations: NormalEquations, structure: ModelStructure, joint: int) -> JointColumns:
    """The model's columns on one joint."""
    n, b, layout = equations.dof, equations.base, equations.layouts[joint]
    used = np.flatnonzero(structure.shapes[joint])
    alone = [*range(len(layout.base)), layout.viscous]
    effects: list[int] = []
    unknown = [*layout.base, b + joint, b + n + joint]
    for effect, start in zip(structure.effects, sizes(equations, structure), strict=False):
        if joint in effect.joints:
            first = layout.first_effect + effect.starts[effect.joints.index(joint)]
            effects += range(first, first + effect.width)
            unknown += range(start, start + effect.width)
    local = np.array([*alone, *(layout.first_reversal + used), *effects])
    a, t, e = len(alone), len(used), len(effects)
    mix = np.zeros((a + t + e, a + 1 + e))
    mix[:a, :a] = np.eye(a)
    mix[a : a + t, a] = structure.shapes[joint, used]
    mix[a + t :, a + 1 :] = np.eye(e)
    return JointColumns(local, mix, np.array(unknown))
