"""Reversal curves of dry friction, chosen joint by joint to leave the smallest residual."""

import numpy as np

from ident.effects.reversal_friction import best_mixture, parts_of
from ident.gap.regression.model_columns import ModelStructure, joint_columns
from ident.gap.regression.normal_equations import NormalEquations
from ident.gap.regression.projection import project_off_with_torque
from ident.gap.regression.weighted_fit import Fit, fit
from ident.signals.arrays import Array

_ROUNDS = 4
_CONVERGED = 0.01  # change of a share
_ABSORBED = 1e-6  # of a column's square: less is rounding


def fit_reversal_curves(equations: NormalEquations, structure: ModelStructure) -> Fit:
    """The fit with the best mixture of reversal curves on each joint."""
    found = fit(equations, structure)
    for _ in range(_ROUNDS):
        shapes = found.structure.shapes.copy()
        for j in range(equations.dof):
            if equations.counts[j].sum() > 0:
                count = equations.layouts[j].reversals
                reduced, torque = orthogonalised(equations, found, j)
                weights, _ = best_mixture(reduced[:count, :count], torque[:count])
                shapes[j] = parts_of(weights, shapes[j])
        change = np.abs(shapes - found.structure.shapes).max()
        found = fit(equations, ModelStructure(shapes, structure.effects), found.sigma)
        if change < _CONVERGED:
            break
    return found


def orthogonalised(equations: NormalEquations, now: Fit, joint: int) -> tuple[Array, Array]:
    """Weighted products of a joint's reversal curves and effects, all other columns projected off.

    Returns:
        products, shape (m, m), and products with the torque, shape (m,). The joint's present
        friction is not projected off. Columns that are fully absorbed are zero.
    """
    layout = equations.layouts[joint]
    weight = 1 / now.sigma[joint] ** 2
    products = np.tensordot(weight, equations.products[joint][0], axes=1)
    here = joint_columns(equations, now.structure)[joint]
    own = slice(layout.first_reversal, layout.torque)
    across = np.zeros((len(now.normal), own.stop - own.start))
    across[here.unknown] = here.across(products, np.arange(own.start, own.stop))
    keep = np.arange(len(now.normal)) != equations.base + equations.dof + joint
    right = now.normal @ now.x  # products of the model's columns with the torque of all joints
    reduced, torque = project_off_with_torque(
        now.normal[np.ix_(keep, keep)],
        across[keep],
        products[own, own],
        (right[keep], products[own, layout.torque]),
    )
    absorbed = np.diag(reduced) <= _ABSORBED * np.diag(products)[own]
    reduced[absorbed], reduced[:, absorbed], torque[absorbed] = 0.0, 0.0, 0.0
    return reduced, torque
