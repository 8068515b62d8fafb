"""How much structure the model so far leaves, and on what it depends."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.observing import CurrentModel
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.basis_functions import (
    GROUPS,
    PERIODIC_IN_TIME,
    Views,
    beat_columns,
    group_columns,
)
from ident.gap.regression.current_model import HELD_OUT, SEARCHED, CurrentFit
from ident.gap.regression.design_matrix import EXCLUDED, Table, WindowedRows, build_design_matrix
from ident.gap.regression.projection import joint_rows, projected
from ident.gap.regression.residuals import Residual, memory_of, residuals
from ident.gap.regression.weighted_fit import Fit, trusted

Array = NDArray[np.floating]

_FREE = 1e-4  # of the largest direction of all free curves: the rest is left to the noise
_LEAST_FREEDOM = 0.1
OF_TRUSTED = 2.0
"""Times the error of its own fit: so much of another recording a trusted model may get wrong."""

_DISAGREE = 0.7  # nats: twice the residual where no fit has looked
_USUAL = 0.95  # of the rows: what only fewer show is a moment, not a part of the recordings
_APART = 6  # rows: noise has forgotten itself by then, the motion has not


@dataclass(frozen=True)
class RemainingStructure:
    """Structure in one joint's residual.

    Attributes:
        joint: from 0.
        group: what it depends on, in words.
        gain: nats per sample, less what chance would give, and on held-out data, whichever is less.
        share: part of the squared residual that it explains.
        detail: which wave of a periodic group.
        ahead: whether only the held-out data show it.
    """

    joint: int
    group: str
    gain: float
    share: float
    detail: int = 0
    ahead: bool = False


def remaining_structures(
    rows: WindowedRows, model: CurrentModel, table: Table, now: Fit
) -> list[RemainingStructure]:
    """Structure of all joints and groups, the strongest first.

    It is searched where effects are, and counts as far as it holds on what no search has seen.

    Args:
        rows: the recordings.
        model: what the columns are formed with.
        table: with the accepted effects' columns.
        now: the present fit.
    """
    left = residuals(table, now)
    found = []
    for j, groups in _groups(rows, model):
        sliding = table.region[:, j] != Region.REVERSAL
        here = [sliding & np.isin(table.fold, SEARCHED), sliding & (table.fold == HELD_OUT)]
        found += _joint(table, now, j, groups, here, left[j].values)
    found += elsewhere(left, table.fold, trusted(table.grams))
    return sorted(found, key=lambda x: -x.gain)


def elsewhere(
    left: list[Residual], fold: NDArray[np.int64], least: Array
) -> list[RemainingStructure]:
    """Joints at which the model fails on the held-out data alone: the recordings disagree.

    A moment, as when a joint that is held slips, is no such failure, and neither is louder noise:
    what does not last from one window to another that is some tenths of a second away.

    Args:
        left: of each joint.
        fold: of each row, shape (R,).
        least: rms residual of each joint that is believed [N m], shape (n,).
    """
    found = []
    for j, r in enumerate(left):
        sliding = r.region != Region.REVERSAL
        folds = fold[: len(sliding)]
        here = _usual_square(r, sliding & np.isin(folds, SEARCHED), 0)
        beyond = _usual_square(r, sliding & (folds == HELD_OUT), _APART)
        floor = float(least[j]) ** 2
        gain = 0.5 * float(np.log(max(beyond, floor) / max(here, floor)))
        if gain > _DISAGREE:
            name = "which part of the recordings it is"
            found.append(
                RemainingStructure(j, name, gain, float(1 - np.exp(-2 * gain)), ahead=True)
            )
    return found


def _usual_square(left: Residual, chosen: NDArray[np.bool_], lag: int) -> float:
    """Mean product of rows so far apart, the largest values cut; of none, zero."""
    values = np.where(chosen, left.values, 0.0)
    if chosen.any():
        most = np.quantile(np.abs(values[chosen]), _USUAL)
        values = np.clip(values, -most, most)
    ahead = slice(lag, None)
    back = slice(0, len(values) - lag)
    both = chosen[ahead] & chosen[back] & (left.segment[ahead] == left.segment[back])
    return float(values[ahead] @ (values[back] * both)) / max(int(both.sum()), 1)


def noise(rows: WindowedRows, present: CurrentFit) -> list[Residual]:
    """What the model leaves, without what free curves can explain of it, of all joints."""
    table = build_design_matrix(rows, present.model, present.accepted)
    left = residuals(table, present.fit)
    for j, groups in _groups(rows, present.model):
        sliding = (table.fold != EXCLUDED) & (table.region[:, j] != Region.REVERSAL)
        columns = np.column_stack([g[sliding] for g in groups])
        values = left[j].values.copy()
        curves, _, rank, _ = np.linalg.lstsq(columns, values[sliding], rcond=_FREE)
        rest = values[sliding] - columns @ curves
        values[sliding] = rest / np.sqrt(max(1 - rank / len(rest), _LEAST_FREEDOM))
        left[j] = replace(left[j], values=values)
    return left


def _groups(rows: WindowedRows, model: CurrentModel) -> Iterator[tuple[int, list[Array]]]:
    """Windowed columns of each group, for each moving joint."""
    views = Views(rows, model)
    for j in model.facts.moving_joints:
        yield j, views.windowed(functools.partial(group_columns, joint=j))


def _joint(
    table: Table,
    now: Fit,
    joint: int,
    groups: list[Array],
    rows: list[NDArray[np.bool_]],
    residual: Array,
) -> list[RemainingStructure]:
    """Structure of one joint; `rows` are those to search, and those to test it on."""
    searched, unseen = (joint_rows(table, now, joint, chosen, residual) for chosen in rows)
    e = searched.error
    square = float(e @ e)
    most = max(square, len(e) * _allowed(table, now, joint))
    tried = []
    for group, formed in zip(GROUPS, groups, strict=True):
        columns, choices = formed, max(formed.shape[1] // 2, 1)
        if group is PERIODIC_IN_TIME and len(e):
            columns, choices = beat_columns(table.t, searched.chosen, e / searched.sigma)
        if columns.shape[1] == 0:
            continue
        curves = projected(now, searched, columns)
        fitted = curves.fitted(e, group.single)
        explained = (curves.scaled - searched.windowed_rows @ curves.absorbed) @ fitted.values
        there = unseen.scaled(columns) - unseen.windowed_rows @ curves.absorbed
        beyond = unseen.error - there @ fitted.values
        many = np.log(choices) + 1 if group.single else len(fitted.values) / 2
        tried.append((group, fitted, e - explained, beyond, many))
    if not tried:
        return []
    least = min((rest for _, _, rest, _, _ in tried), key=lambda r: float(r @ r))
    effective = len(e) / memory_of(least, table.segment[searched.chosen])
    found = []
    for group, fitted, rest, beyond, many in tried:
        share = float(np.clip((square - float(rest @ rest)) / most, 0.0, 1 - 1e-9))
        nats = -0.5 * np.log(1 - share) - many / effective
        held = _log_ratio(unseen.error, beyond)
        name = group.name.format(j=joint + 1)
        found.append(RemainingStructure(joint, name, float(min(nats, held)), share, fitted.place))
    return found


def _allowed(table: Table, now: Fit, joint: int) -> float:
    """Mean square of a residual, in units of its noise, that says nothing."""
    if table.grams.least is None:
        return 1.0
    known = OF_TRUSTED * float(table.grams.least[joint])
    return max(1.0, (known / float(now.sigma[joint, Region.SLIDING])) ** 2)


def _log_ratio(before: Array, after: Array) -> float:
    """Nats per sample by which a residual is smaller."""
    if len(before) == 0:
        return np.inf
    squares = [max(float(np.mean(e**2)), 1e-12) for e in (before, after)]
    return 0.5 * float(np.log(squares[0] / squares[1]))
