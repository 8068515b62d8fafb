"""Cross-validation: gain of an effect on folds that it was not fitted to."""

import numpy as np

from ident.gap.data.blocks import FOLDS
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.weighted_fit import Fit, fit, mean_log_ratio, predicted_rms
from ident.gap.selection.scoring import Score
from ident.gap.settings import CrossValidation
from ident.signals.arrays import Array


def excites(
    design: DesignMatrix, index: int, now: Fit, fold: int, settings: CrossValidation
) -> bool:
    """Whether a fold excites an effect enough to judge it."""
    return fold in _exciting_folds(design, index, now, settings)


def passes_cross_validation(
    design: DesignMatrix, score: Score, before: Fit, settings: CrossValidation
) -> bool:
    """Whether every fold that excites the effect is predicted clearly better with it."""
    gains = held_out_gains(design, score, before, settings)
    return bool(gains) and min(gains) > settings.min_gain_share * score.gain


def held_out_gains(
    design: DesignMatrix, score: Score, before: Fit, settings: CrossValidation
) -> tuple[float, ...]:
    """Gain on each fold that excites the effect, with both models fitted on the other folds.

    An effect that one fold alone excites, such as a drive that saturates in one of several motions,
    is validated on three parts of that fold.
    """
    folds = _exciting_folds(design, score.index, before, settings)
    if len(folds) == 1:
        design = _split_by_energy(design, score.index, before, folds[0])
        folds = list(range(FOLDS))
    gains = []
    for fold in folds:
        rest = design.equations.of([f for f in range(FOLDS) if f != fold])
        here = design.equations.of([fold])
        if here.counts.sum() == 0 or rest.counts.sum() == 0:
            continue
        old = fit(rest, before.structure, before.sigma)
        new = fit(rest, score.fit.structure, score.fit.sigma)
        errors = predicted_rms(here, old), predicted_rms(here, new)
        gains.append(float(mean_log_ratio(*errors, here.counts[:, 0]).sum()))
    return tuple(gains)


def _exciting_folds(
    design: DesignMatrix, index: int, now: Fit, settings: CrossValidation
) -> list[int]:
    energy = effect_energy(design, index, now)
    share = np.array([energy[design.fold == f].sum() for f in range(FOLDS)])
    return np.flatnonzero(share > settings.min_energy_share * share.sum()).tolist()


def effect_energy(design: DesignMatrix, index: int, now: Fit) -> Array:
    """Squared columns of an effect in each row, in units of the noise, shape (R,)."""
    energy = np.zeros(len(design.fold))
    for j in design.index[index].joints:
        columns = design.effect_columns(index, j)
        if len(columns):
            energy += (columns**2).sum(axis=1) / now.sigma[j][design.region[:, j]] ** 2
    return energy


def _split_by_energy(design: DesignMatrix, index: int, now: Fit, fold: int) -> DesignMatrix:
    """One fold divided into three parts of equal excitation, which join the three folds."""
    energy = np.where(design.fold == fold, effect_energy(design, index, now), 0.0)
    part = np.minimum(FOLDS * np.cumsum(energy) / energy.sum(), FOLDS - 1).astype(np.int64)
    return design.with_folds(np.where(design.fold == fold, part, design.fold))
