"""Cross-validation: gain of an effect on folds that it was not fitted to."""

from dataclasses import dataclass, replace

import numpy as np

from ident.gap.data.blocks import FOLDS
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.model_columns import without_effect
from ident.gap.regression.weighted_fit import Fit, fit, mean_log_ratio, predicted_rms
from ident.gap.selection.scoring import Score
from ident.gap.settings import CrossValidation
from ident.signals.arrays import Array


@dataclass(frozen=True)
class FoldGain:
    """What an effect gains on one fold [nats per sample], all else fitted to all folds.

    Attributes:
        carried: with the size that the other folds give it.
        own: with the size that all folds give it, this one among them.
    """

    carried: float
    own: float


def excites(
    design: DesignMatrix, index: int, now: Fit, fold: int, settings: CrossValidation
) -> bool:
    """Whether a fold excites an effect enough to judge it."""
    return fold in _exciting_folds(design, index, now, settings)


def passes_cross_validation(
    design: DesignMatrix, score: Score, before: Fit, settings: CrossValidation
) -> bool:
    """Whether an effect keeps its gain on every fold that excites it, without that fold's word.

    A fold in which it is weak, or noise is loud, gains little of any size: what counts is the share
    of what the effect gains there at all.
    """
    gains = fold_gains(design, score, before, settings)
    return bool(gains) and all(
        g.own > 0.0 and g.carried > settings.min_gain_share * g.own for g in gains
    )


def fold_gains(
    design: DesignMatrix, score: Score, before: Fit, settings: CrossValidation
) -> tuple[FoldGain, ...]:
    """Gain on each fold that excites the effect.

    An effect that one fold alone excites, such as a drive that saturates in one of several motions,
    is validated on three parts of that fold.
    """
    folds = _exciting_folds(design, score.index, before, settings)
    if len(folds) == 1:
        design = _split_by_energy(design, score.index, before, folds[0])
        folds = list(range(FOLDS))
    every = design.equations.of(range(FOLDS))
    without = fit(every, before.structure, before.sigma)
    whole = fit(every, score.fit.structure, score.fit.sigma)
    gains = []
    for fold in folds:
        rest = design.equations.of([f for f in range(FOLDS) if f != fold])
        here = design.equations.of([fold])
        if here.counts.sum() == 0 or rest.counts.sum() == 0:
            continue
        size = fit(rest, score.fit.structure, score.fit.sigma).effects[-1]
        carried = gain_of(size, design, score.index, fold, without, score.fit)
        errors = predicted_rms(here, without), predicted_rms(here, whole)
        own = float(mean_log_ratio(*errors, here.counts[:, 0]).sum())
        gains.append(FoldGain(carried, own))
    return tuple(gains)


def gain_of(
    size: Array, design: DesignMatrix, index: int, fold: int, without: Fit, beside: Fit
) -> float:
    """Gain on a fold, at all joints, of an effect of known size, all else fitted to all folds.

    What is asked is whether the effect carries over, and not whether the links do, which no single
    fold may tell.

    Args:
        size: its coefficients, shape (k,), from other folds.
        design: with the effect's columns.
        index: of the effect.
        fold: the one that is judged.
        without: the fit to all folds without it.
        beside: a fit with it, whose other columns are taken.
    """
    effect = design.index[index]
    others = tuple(e for e in beside.structure.effects if e != effect)
    structure = replace(beside.structure, effects=others)
    less = without_effect(design.equations, effect, size)
    fitted = fit(less.of(range(design.folds)), structure, beside.sigma)
    here = design.equations.of([fold])
    errors = predicted_rms(here, without), predicted_rms(less.of([fold]), fitted)
    return float(mean_log_ratio(*errors, here.counts[:, 0]).sum())


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
