"""Whether an effect holds on data that it was not fitted to, wherever these can speak of it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.noise_regions import Region
from ident.gap.regression.design_matrix import FOLDS, Table
from ident.gap.regression.normal_equations import joint_products
from ident.gap.regression.scoring import Score
from ident.gap.regression.weighted_fit import Fit, fit, mean_log_ratio, predicted_rms

Array = NDArray[np.floating]

_IDLE = 0.1  # of an effect's squared torque: a fold with less of it cannot speak of it
_HELD = 0.25  # of its gain: what an effect must bring on every fold, fitted on the others


def excites(table: Table, index: int, present: Fit, fold: int) -> bool:
    """Whether a fold has enough of an effect to speak of it."""
    return fold in _acting(table, index, present)


def holds(table: Table, score: Score, before: Fit) -> bool:
    """Whether every part of the data is predicted clearly better with the effect than without."""
    gains = held_out_gains(table, score, before)
    return bool(gains) and min(gains) > _HELD * score.gain


def held_out_gains(table: Table, score: Score, before: Fit) -> tuple[float, ...]:
    """Predicted gain on each fold that has enough of the effect, both fitted on the others.

    An effect that acts in one fold alone, as a drive does that clips in one of several motions, is
    asked in three parts of that one.
    """
    acting = _acting(table, score.index, before)
    if len(acting) == 1:
        table = _split_by_energy(table, score, before, acting[0])
        acting = list(range(FOLDS))
    gains = []
    for fold in acting:
        rest = table.grams.of([f for f in range(FOLDS) if f != fold])
        here = table.grams.of([fold])
        if here.counts.sum() == 0 or rest.counts.sum() == 0:
            continue
        old = fit(rest, before.choice, before.sigma)
        new = fit(rest, score.fit.choice, score.fit.sigma)
        ratio = mean_log_ratio(
            predicted_rms(here, old), predicted_rms(here, new), here.counts[:, 0]
        )
        gains.append(float(ratio.sum()))
    return tuple(gains)


def _acting(table: Table, index: int, present: Fit) -> list[int]:
    energy = _energy(table, index, present)
    share = np.array([energy[table.fold == f].sum() for f in range(FOLDS)])
    return np.flatnonzero(share > _IDLE * share.sum()).tolist()


def _energy(table: Table, index: int, present: Fit) -> Array:
    """Weighted squared columns of a hypothesis in each row, shape (R,)."""
    slot, energy = table.slots[index], np.zeros(len(table.fold))
    for j, start in zip(slot.joints, slot.starts, strict=True):
        first = table.grams.layouts[j].first_extra + start
        columns = table.columns[j][:, first : first + slot.width]
        if len(columns):
            energy += (columns**2).sum(axis=1) / present.sigma[j][table.region[:, j]] ** 2
    return energy


def _split_by_energy(table: Table, score: Score, present: Fit, fold: int) -> Table:
    """The table with three parts of one fold, each with as much of the effect, among the folds."""
    energy = np.where(table.fold == fold, _energy(table, score.index, present), 0.0)
    part = np.minimum(FOLDS * np.cumsum(energy) / energy.sum(), FOLDS - 1).astype(np.int64)
    folds = np.where(table.fold == fold, part, table.fold)
    others = [s for s in table.slots.values() if s not in score.fit.choice.slots]
    products, counts = [], []
    for j, (layout, columns) in enumerate(zip(table.grams.layouts, table.columns, strict=True)):
        own = [(s.starts[s.joints.index(j)], s.width) for s in others if j in s.joints]
        tried = [(layout.first_extra + start, width) for start, width in own]
        use = slice(len(columns))
        product, count = joint_products(
            columns, folds[use], table.region[use, j], (FOLDS, len(Region)), tried
        )
        products.append(product)
        counts.append(count)
    grams = replace(table.grams, products=tuple(products), counts=np.array(counts))
    return replace(table, fold=folds, grams=grams)
