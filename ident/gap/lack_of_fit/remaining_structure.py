"""Test for lack of fit: structure in the residual that free curves explain on held-out data too."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.observing import CurrentModel
from ident.gap.data.blocks import EXCLUDED, HELD_OUT, SEARCHED
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.basis_functions import (
    GROUPS,
    PERIODIC_IN_ANGLE,
    PERIODIC_IN_TIME,
    FreeCurves,
    beat_columns,
    group_columns,
    wave_numbers,
)
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.projection import JointRows, joint_rows, projected
from ident.gap.regression.residuals import Residual, autocorrelation_length, residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import Fit, noise_floor
from ident.gap.settings import EffectFreeData, LackOfFit
from ident.signals.arrays import Array

_RANK = 1e-4  # of the largest direction of all free curves: smaller ones are left to the noise


@dataclass(frozen=True)
class RemainingStructure:
    """Structure in one joint's residual.

    Attributes:
        joint: from 0.
        group: the variable that it depends on, in words.
        gain: [nats per sample]: the smaller of the searched folds' gain, less what chance would
            give, and the held-out fold's.
        share: share of the squared residual that it explains.
        held_out_only: only the held-out data show it.
    """

    joint: int
    group: str
    gain: float
    share: float
    held_out_only: bool = False


def share_of(gain: float) -> float:
    """Share of the squared residual that a gain [nats per sample] stands for."""
    return float(1 - np.exp(-2 * gain))


def remaining_structures(
    rows: WindowedRows, current: CurrentFit, settings: LackOfFit
) -> list[RemainingStructure]:
    """Structure of all joints and groups of curves, the strongest first.

    The curves are fitted on the searched folds and judged on the held-out one.
    """
    design = current.design(rows)
    left = residuals(design, current.fit)
    found = []
    for j, groups in _groups(rows, current.model):
        sliding = design.region[:, j] != Region.REVERSAL
        folds = np.isin(design.fold, SEARCHED), design.fold == HELD_OUT
        searched, unseen = (
            joint_rows(design, current.fit, j, sliding & fold, left[j].values) for fold in folds
        )
        allowed = _allowed(design, current.fit, j, settings)
        found += _joint_structures(design, current.fit, j, groups, (searched, unseen), allowed)
    found += held_out_mismatch(left, design.fold, noise_floor(design.equations), settings)
    return sorted(found, key=lambda x: -x.gain)


def held_out_mismatch(
    left: list[Residual], fold: NDArray[np.int64], floor: Array, settings: LackOfFit
) -> list[RemainingStructure]:
    """Joints at which the model fails on the held-out data alone: the recordings disagree.

    Only failures that last count. Short ones are clipped, and louder noise is removed by
    multiplying each row with one some tenths of a second later.

    Args:
        left: residuals of each joint.
        fold: of each row, shape (R,).
        floor: smallest rms residual of each joint that is believed [N m], shape (n,).
        settings: of the test.
    """
    found = []
    for j, r in enumerate(left):
        sliding = r.region != Region.REVERSAL
        folds = fold[: len(sliding)]
        quantile, lag = settings.usual_quantile, settings.memory_rows
        here = _clipped_square(r, sliding & np.isin(folds, SEARCHED), quantile, 0)
        beyond = _clipped_square(r, sliding & (folds == HELD_OUT), quantile, lag)
        least = float(floor[j]) ** 2
        gain = 0.5 * float(np.log(max(beyond, least) / max(here, least)))
        if gain > settings.disagreement:
            name = "which part of the recordings it is"
            found.append(RemainingStructure(j, name, gain, share_of(gain), held_out_only=True))
    return found


def _clipped_square(left: Residual, chosen: NDArray[np.bool_], quantile: float, lag: int) -> float:
    """Mean product of rows a lag apart, values clipped at a quantile; zero without rows."""
    values = np.where(chosen, left.values, 0.0)
    if chosen.any():
        most = np.quantile(np.abs(values[chosen]), quantile)
        values = np.clip(values, -most, most)
    ahead = slice(lag, None)
    back = slice(0, len(values) - lag)
    both = chosen[ahead] & chosen[back] & (left.block[ahead] == left.block[back])
    return float(values[ahead] @ (values[back] * both)) / max(int(both.sum()), 1)


def structureless_noise(
    rows: WindowedRows, current: CurrentFit, settings: EffectFreeData
) -> list[Residual]:
    """Residuals of all joints without the part that free curves explain."""
    design = current.design(rows)
    left = residuals(design, current.fit)
    for j, groups in _groups(rows, current.model):
        sliding = (design.fold != EXCLUDED) & (design.region[:, j] != Region.REVERSAL)
        columns = np.column_stack([g[sliding] for g in groups])
        values = left[j].values.copy()
        curves, _, rank, _ = np.linalg.lstsq(columns, values[sliding], rcond=_RANK)
        rest = values[sliding] - columns @ curves
        free = max(1 - rank / max(len(rest), 1), settings.min_free_share)
        values[sliding] = rest / np.sqrt(free)
        left[j] = replace(left[j], values=values)
    return left


def _groups(rows: WindowedRows, model: CurrentModel) -> Iterator[tuple[int, list[Array]]]:
    """Windowed columns of each group, for each moving joint."""
    curves = FreeCurves(rows, model)
    for j in model.facts.moving_joints:
        yield j, curves.windowed(functools.partial(group_columns, joint=j))


def _joint_structures(
    design: DesignMatrix,
    now: Fit,
    joint: int,
    groups: list[Array],
    rows: tuple[JointRows, JointRows],
    allowed: float,
) -> list[RemainingStructure]:
    """Structure of one joint, on the rows to search, and on those to judge it by."""
    searched, unseen = rows
    e = searched.error
    if len(e) == 0:
        return []
    tried = []
    for group, formed in zip(GROUPS, groups, strict=True):
        columns, choices, name = formed, max(formed.shape[1] // 2, 1), group.name
        if group is PERIODIC_IN_TIME:
            columns, choices, hz = beat_columns(design.t, searched.chosen, e / searched.sigma)
            name += f", at about {hz:.2g} Hz"
        if columns.shape[1] == 0:
            continue
        curves = projected(now, searched, columns)
        fitted = curves.fitted(e, group.single)
        if group is PERIODIC_IN_ANGLE:
            number = wave_numbers()[int(np.abs(fitted.values).argmax()) // 2]
            name += f", about every {2 * np.pi / number:.2g} rad"
        explained = (curves.scaled - searched.model @ curves.absorbed) @ fitted.values
        there = unseen.scaled(columns) - unseen.model @ curves.absorbed
        beyond = unseen.error - there @ fitted.values
        freedom = np.log(choices) + 1 if group.single else len(fitted.values) / 2
        tried.append((name, e - explained, beyond, freedom))
    if not tried:
        return []
    square = float(e @ e)
    most = max(square, len(e) * allowed)
    least = min((rest for _, rest, _, _ in tried), key=lambda r: float(r @ r))
    effective = len(e) / autocorrelation_length(least, design.block[searched.chosen])
    found = []
    for name, rest, beyond, freedom in tried:
        share = float(np.clip((square - float(rest @ rest)) / most, 0.0, 1 - 1e-9))
        nats = -0.5 * np.log(1 - share) - freedom / effective
        held = _log_ratio(unseen.error, beyond)
        told = name.format(j=joint + 1)
        found.append(RemainingStructure(joint, told, float(min(nats, held)), share))
    return found


def _allowed(design: DesignMatrix, now: Fit, joint: int, settings: LackOfFit) -> float:
    """Mean squared residual, in units of its noise, that a reference model's error explains."""
    if design.equations.reference_error is None:
        return 1.0
    known = settings.reference_error_factor * float(design.equations.reference_error[joint])
    return max(1.0, (known / float(now.sigma[joint, Region.SLIDING])) ** 2)


def _log_ratio(before: Array, after: Array) -> float:
    """Nats per sample by which a residual is smaller."""
    if len(before) == 0:
        return np.inf
    squares = [max(float(np.mean(e**2)), 1e-12) for e in (before, after)]
    return 0.5 * float(np.log(squares[0] / squares[1]))
