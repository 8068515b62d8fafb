"""The current model: rigid body, friction and accepted effects, fitted together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.effects.candidate import Candidate
from ident.effects.observation import ArmFacts
from ident.effects.observing import CurrentModel, on_links
from ident.effects.reversal_friction import SLOW, USUAL, MaxwellSlipMixture, reversal_speed
from ident.gap.data.blocks import SEARCHED
from ident.gap.regression.design_matrix import DesignMatrix, build_design_matrix
from ident.gap.regression.model_columns import ModelStructure
from ident.gap.regression.reversal_curves import curves_beside, fit_reversal_curves
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import Fit
from ident.signals.arrays import Array

_ROUNDS = 6


@dataclass(frozen=True)
class CurrentFit:
    """The current model and its fit.

    Attributes:
        model: current estimates, with which the effects' columns are formed.
        accepted: effects in the model.
        fit: on the searched folds.
    """

    model: CurrentModel
    accepted: tuple[Candidate, ...]
    fit: Fit

    def design(self, rows: WindowedRows, candidates: Sequence[Candidate] = ()) -> DesignMatrix:
        """The design matrix of the model, and of candidates beside it."""
        return build_design_matrix(rows, self.model, self.accepted, candidates)


def nominal_fit(rows: WindowedRows, facts: ArmFacts) -> CurrentFit:
    """The rigid-body model with viscous and Coulomb friction."""
    none = np.zeros(facts.dof)
    shapes = np.tile(USUAL, (facts.dof, 1))
    model = CurrentModel(facts, none, none, shapes, np.full(facts.dof, SLOW[0]))
    empty = np.zeros((facts.dof, 1))
    nothing = Fit(ModelStructure(shapes), empty[0], empty, empty.astype(int), empty)
    return _converged(rows, CurrentFit(model, (), nothing))


def extend(rows: WindowedRows, current: CurrentFit, effects: Sequence[Candidate]) -> CurrentFit:
    """The model with more effects, everything fitted again."""
    return _converged(rows, replace(current, accepted=(*current.accepted, *effects)))


def _converged(rows: WindowedRows, current: CurrentFit) -> CurrentFit:
    """Reversal curves, noise regions and parameters that agree with each other.

    A wide reversal curve widens the reversal region, in which a narrow curve may fit as well, which
    narrows the region again: after the first two rounds the region only grows.
    """
    for iteration in range(_ROUNDS):
        slow = current.model.slow
        design = current.design(rows)
        found = fit_reversal_curves(
            design.equations.of(SEARCHED),
            design.structure(current.model.shapes),
            curves_beside(current.accepted, len(slow)),
        )
        least = slow if iteration > 1 else np.zeros_like(slow)
        model = _updated(rows, current, found, least)
        current = CurrentFit(model, current.accepted, found)
        if iteration and (model.slow == slow).all():
            break
    return current


def _updated(rows: WindowedRows, current: CurrentFit, found: Fit, least: Array) -> CurrentModel:
    model = current.model
    b, n = len(rows.base_parameters), model.facts.dof
    delta = model.facts.delta.copy()
    if b and not model.facts.trusted:
        delta[:] = 0.0
    delta[rows.base_parameters] = found.x[:b]
    shapes = found.structure.shapes
    return CurrentModel(
        replace(model.facts, delta=delta),
        found.x[b : b + n],
        found.x[b + n : b + 2 * n],
        shapes,
        np.maximum(least, [reversal_speed(MaxwellSlipMixture(s).width) for s in shapes]),
        on_links(current.accepted, found.effects),
    )
