"""Whether an effect is more than what the form of an earlier one gets wrong."""

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.basis_functions import Views, form_columns
from ident.gap.regression.current_model import SEARCHED, CurrentFit
from ident.gap.regression.design_matrix import Table, WindowedRows
from ident.gap.regression.projection import joint_rows, projected
from ident.gap.regression.residuals import residuals
from ident.gap.regression.scoring import Score
from ident.gap.regression.weighted_fit import Fit, mean_squares

Array = NDArray[np.floating]

_SMALL = 0.12  # of what an effect of uncertain form explained: less may be its form's error
_BESIDE = 0.5  # of its gain: what it must bring beside free curves for the earlier one's form


def maybe_misspecification(
    score: Score,
    before: Fit,
    seat: Sequence[int],
    earlier: Sequence[tuple[Candidate, Sequence[int], Array]],
) -> list[tuple[Candidate, int]]:
    """Earlier effects, and joints, beside which an effect is so small that it may be their error.

    Args:
        score: of the effect.
        before: the model without it.
        seat: the joints that carry its gain, from 0.
        earlier: effects, their own seats, and the squares that they removed per joint, shape (n,).
    """
    here = list(seat)
    drop = (mean_squares(before) - mean_squares(score.fit))[here].sum()
    found = []
    for hypothesis, seat_then, explained in earlier:
        if hypothesis.effect == score.hypothesis.effect:
            continue
        if catalogue()[hypothesis.effect].form_uncertainty is FormUncertainty.NONE:
            continue
        if set(seat_then) & set(here) and drop < _SMALL * explained[here].sum():
            found += [(hypothesis, j) for j in here if j in seat_then]
    return found


def significant_beside(
    rows: WindowedRows,
    present: CurrentFit,
    table: Table,
    score: Score,
    suspects: Sequence[tuple[Candidate, int]],
) -> bool:
    """Whether most of an effect's gain is left beside free curves for the forms of others.

    Args:
        rows: the recordings.
        present: the model without the effect.
        table: with its columns.
        score: of the effect.
        suspects: the other effects, and on which joints, from 0.
    """
    return all(_beside(rows, present, table, score, j, h) for h, j in suspects)


def _beside(
    rows: WindowedRows,
    present: CurrentFit,
    table: Table,
    score: Score,
    joint: int,
    other: Candidate,
) -> bool:
    freedom = catalogue()[other.effect].form_uncertainty
    if freedom is FormUncertainty.ANY or joint not in score.hypothesis.rows:
        return False
    form = functools.partial(form_columns, joint=joint, freedom=freedom)
    curves = Views(rows, present.model).windowed(form)[0]
    slot = table.slots[score.index]
    start = slot.starts[slot.joints.index(joint)] + table.grams.layouts[joint].first_extra
    own = table.columns[joint][:, start : start + slot.width]
    sliding = np.isin(table.fold, SEARCHED) & (table.region[:, joint] != Region.REVERSAL)
    left = residuals(table, present.fit)[joint].values
    here = joint_rows(table, present.fit, joint, sliding, left)
    whole = float(here.error @ here.error)
    rest = [
        max(1e-12 * whole, whole - 2 * projected(present.fit, here, c).fitted(here.error).gain)
        for c in (np.zeros((len(own), 0)), own, curves, np.column_stack([curves, own]))
    ]
    alone, beside = np.log(rest[0] / rest[1]), np.log(rest[2] / rest[3])
    return bool(beside > _BESIDE * alone > 0.0)
