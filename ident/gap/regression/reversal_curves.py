"""Reversal curves of dry friction, chosen joint by joint to leave the smallest residual."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.effects.reversal_friction import ENDING, best_mixture, parts_of
from ident.gap.regression.model_columns import ModelStructure, joint_columns
from ident.gap.regression.normal_equations import NormalEquations
from ident.gap.regression.projection import project_off_with_torque
from ident.gap.regression.weighted_fit import Fit, fit
from ident.signals.arrays import Array

_ROUNDS = 4
_CONVERGED = 0.01  # change of a share
_ABSORBED = 1e-6  # of a column's square: less is rounding


def curves_beside(effects: Sequence[Candidate], dof: int) -> NDArray[np.bool_]:
    """The curves that a joint's friction may be mixed of beside some effects, shape (n, T).

    A long tail and an effect that is a curve over the speed itself explain the same: one or the
    other.
    """
    usable = np.ones((dof, len(ENDING)), dtype=bool)
    for h in effects:
        if catalogue()[h.effect].form_uncertainty is FormUncertainty.SPEED:
            usable[list(h.joints)] = ENDING
    return usable


def fit_reversal_curves(
    equations: NormalEquations, structure: ModelStructure, usable: NDArray[np.bool_]
) -> Fit:
    """The fit with the best mixture of reversal curves on each joint.

    Args:
        equations: inner products of the data to use, as one fold.
        structure: the model's columns.
        usable: curves that may be mixed, shape (n, T).
    """
    found = fit(equations, structure)
    for _ in range(_ROUNDS):
        shapes = found.structure.shapes.copy()
        for j in range(equations.dof):
            if equations.counts[j].sum() > 0:
                count = equations.layouts[j].reversals
                reduced, torque = orthogonalised(equations, found, j)
                weights, _ = best_mixture(reduced[:count, :count], torque[:count], usable[j])
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
