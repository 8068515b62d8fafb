"""How much structure the model so far leaves, and on what it depends."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.fit import Fit, places, solve
from ident.gap.generic import GROUPS, group_columns
from ident.gap.region import Region
from ident.gap.residual import Residual, memory_of, residuals
from ident.gap.search import Present
from ident.gap.table import APART, Nominal, PresentModel, Table, body_step, observed, tabulate

Array = NDArray[np.floating]

_RIDGE = 1e-6
_FREE = 1e-4  # of the largest direction of all free curves: the rest is left to the noise
_LEAST_FREEDOM = 0.1
_SEEN = 1e-5  # of the columns' own squares: what is left of a direction after projection


@dataclass(frozen=True)
class Leftover:
    """Structure in one joint's residual.

    Attributes:
        joint: from 0.
        group: what it depends on, in words.
        gain: nats per sample, less what chance would give.
        share: part of the squared residual that it explains.
        detail: which wave of a periodic group.
    """

    joint: int
    group: str
    gain: float
    share: float
    detail: int = 0


def leftovers(
    rows: Nominal, model: PresentModel, table: Table, now: Fit, folds: tuple[int, ...]
) -> list[Leftover]:
    """Structure of all joints and groups, the strongest first.

    Args:
        rows: the recordings.
        model: what the columns are formed with.
        table: with the accepted effects' columns.
        now: the present fit.
        folds: the data to use.
    """
    left = residuals(table, now)
    used = np.isin(table.fold, folds)
    found = []
    for j, groups in _groups(rows, model):
        sliding = used & (table.region[:, j] != Region.TURNING)
        found += _joint(table, now, j, groups, sliding, left[j].values)
    return sorted(found, key=lambda x: -x.gain)


def noise(rows: Nominal, present: Present) -> list[Residual]:
    """What the model leaves, without what free curves can explain of it, of all joints."""
    table = tabulate(rows, present.model, present.accepted)
    left = residuals(table, present.fit)
    for j, groups in _groups(rows, present.model):
        sliding = (table.fold != APART) & (table.region[:, j] != Region.TURNING)
        columns = np.column_stack([g[sliding] for g in groups])
        values = left[j].values.copy()
        curves, _, rank, _ = np.linalg.lstsq(columns, values[sliding], rcond=_FREE)
        rest = values[sliding] - columns @ curves
        values[sliding] = rest / np.sqrt(max(1 - rank / len(rest), _LEAST_FREEDOM))
        left[j] = replace(left[j], values=values)
    return left


def _groups(rows: Nominal, model: PresentModel) -> Iterator[tuple[int, list[Array]]]:
    """Windowed columns of each group, for each moving joint."""
    whole = np.concatenate([s.q for s in rows.stretches])
    span = whole.min(axis=0), whole.max(axis=0)
    end = max(float(s.t[-1]) for s in rows.stretches)
    every = body_step(rows.windows)
    wide = rows.windows.coarser(every)
    seen = [observed(s, model, every)[1] for s in rows.stretches]
    for j in model.facts.moving_joints:
        blocks = [group_columns(s, j, span, end) for s in seen]
        yield (
            j,
            [
                np.concatenate(
                    [wide.mean(b[g])[: len(y)] for b, y in zip(blocks, rows.torque, strict=True)]
                )
                for g in range(len(GROUPS))
            ],
        )


def _joint(
    table: Table,
    now: Fit,
    joint: int,
    groups: list[Array],
    rows: NDArray[np.bool_],
    residual: Array,
) -> list[Leftover]:
    pl = places(table.grams, now.choice)[joint]
    sigma = now.sigma[joint][table.region[rows, joint]]
    nominal = pl.of(table.columns[joint][rows]) / sigma[:, None]
    e = residual[rows] / sigma
    square = float(e @ e)
    tried = []
    for group, columns in zip(GROUPS, groups, strict=True):
        if columns.shape[1] == 0:
            continue
        scaled = columns[rows] / sigma[:, None]
        across = np.zeros((len(now.normal), scaled.shape[1]))
        across[pl.unknown] = nominal.T @ scaled
        projected = solve(now.normal, across)
        products = scaled.T @ scaled - across.T @ projected
        fitted = _fitted(products, scaled.T @ e, scaled, group.single)
        rest = e - (scaled - nominal @ projected[pl.unknown]) @ fitted.values
        tried.append((group, fitted, rest, scaled.shape[1]))
    if not tried:
        return []
    least = min((rest for _, _, rest, _ in tried), key=lambda r: float(r @ r))
    effective = len(e) / memory_of(least, table.stretch[rows])
    found = []
    for group, fitted, rest, size in tried:
        share = float(np.clip((square - float(rest @ rest)) / max(square, len(e)), 0.0, 1 - 1e-9))
        many = np.log(size / 2) + 1 if group.single else size / 2
        nats = -0.5 * np.log(1 - share) - many / effective
        name = group.name.format(j=joint + 1)
        found.append(Leftover(joint, name, float(nats), share, fitted.place))
    return found


@dataclass(frozen=True)
class _Fitted:
    """Coefficients of a group, half the drop of the squares, and the best pair's place."""

    values: Array
    gain: float
    place: int


def _fitted(products: Array, right: Array, scaled: Array, single: bool) -> _Fitted:
    scale = np.sqrt(np.maximum((scaled**2).sum(axis=0), 1e-300))
    products = products / scale[:, None] / scale + _RIDGE * np.eye(len(scale))
    right = right / scale
    if not single:
        lengths, axes = np.linalg.eigh(products)
        seen = axes[:, lengths > _SEEN]  # the rest is in the model already
        values = seen @ ((seen.T @ right) / lengths[lengths > _SEEN])
        return _Fitted(values / scale, float(right @ values) / 2, 0)
    blocks = np.stack([products[i : i + 2, i : i + 2] for i in range(0, len(scale), 2)])
    rights = right.reshape(-1, 2)
    values = np.linalg.solve(blocks, rights[..., None])[..., 0]
    gains = np.einsum("wi,wi->w", rights, values) / 2
    best = int(gains.argmax())
    chosen = np.zeros(len(scale))
    chosen[2 * best : 2 * best + 2] = values[best]
    return _Fitted(chosen / scale, float(gains[best]), best)
