"""How much structure the model so far leaves, and on what it depends."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.fit import Fit, Places, mean_squares, places, predicted_rms, solve
from ident.gap.generic import BEAT, GROUPS, beat_columns, group_columns
from ident.gap.region import Region
from ident.gap.residual import Residual, memory_of, residuals
from ident.gap.search import HELD_OUT, SEARCHED, Present
from ident.gap.table import APART, Nominal, PresentModel, Table, body_step, observed, tabulate

Array = NDArray[np.floating]

_RIDGE = 1e-6
_FREE = 1e-4  # of the largest direction of all free curves: the rest is left to the noise
_LEAST_FREEDOM = 0.1
_DISAGREE = 0.7  # nats: twice the residual where no fit has looked
_SEEN = 1e-5  # of the columns' own squares: what is left of a direction after projection


@dataclass(frozen=True)
class Leftover:
    """Structure in one joint's residual.

    Attributes:
        joint: from 0.
        group: what it depends on, in words.
        gain: nats per sample, less what chance would give, and on held-out data, whichever is less.
        share: part of the squared residual that it explains.
        detail: which wave of a periodic group.
    """

    joint: int
    group: str
    gain: float
    share: float
    detail: int = 0


def leftovers(rows: Nominal, model: PresentModel, table: Table, now: Fit) -> list[Leftover]:
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
        sliding = table.region[:, j] != Region.TURNING
        here = [sliding & np.isin(table.fold, SEARCHED), sliding & (table.fold == HELD_OUT)]
        found += _joint(table, now, j, groups, here, left[j].values)
    found += _elsewhere(table, now)
    return sorted(found, key=lambda x: -x.gain)


def _elsewhere(table: Table, now: Fit) -> list[Leftover]:
    """Joints at which the model fails on the held-out data alone: the recordings disagree."""
    there = table.grams.of([HELD_OUT])
    ahead = replace(now, sigma=predicted_rms(there, now), counts=there.counts[:, 0])
    here, beyond = mean_squares(now), mean_squares(ahead)
    found = []
    for j in np.flatnonzero(beyond > here * np.exp(2 * _DISAGREE)):
        gain = 0.5 * float(np.log(beyond[j] / here[j]))
        name = "which part of the recordings it is"
        found.append(Leftover(int(j), name, gain, float(1 - here[j] / beyond[j])))
    return found


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


@dataclass(frozen=True)
class _Rows:
    """Residuals and model columns of some rows of a joint, in units of their noise."""

    chosen: NDArray[np.bool_]
    sigma: Array
    nominal: Array
    error: Array

    def scaled(self, columns: Array) -> Array:
        """Other columns in the same rows and units."""
        return columns[self.chosen] / self.sigma[:, None]


def _joint(
    table: Table,
    now: Fit,
    joint: int,
    groups: list[Array],
    rows: list[NDArray[np.bool_]],
    residual: Array,
) -> list[Leftover]:
    """Structure of one joint; `rows` are those to search, and those to test it on."""
    pl = places(table.grams, now.choice)[joint]
    searched, unseen = (_rows(table, now, joint, pl, chosen, residual) for chosen in rows)
    e = searched.error
    square = float(e @ e)
    tried = []
    for group, formed in zip(GROUPS, groups, strict=True):
        columns, choices = formed, max(formed.shape[1] // 2, 1)
        if group is BEAT and len(e):
            columns, choices = beat_columns(table.t, searched.chosen, e / searched.sigma)
        if columns.shape[1] == 0:
            continue
        scaled = searched.scaled(columns)
        across = np.zeros((len(now.normal), scaled.shape[1]))
        across[pl.unknown] = searched.nominal.T @ scaled
        projected = solve(now.normal, across)
        products = scaled.T @ scaled - across.T @ projected
        fitted = _fitted(products, scaled.T @ e, scaled, group.single)
        explained = (scaled - searched.nominal @ projected[pl.unknown]) @ fitted.values
        there = unseen.scaled(columns) - unseen.nominal @ projected[pl.unknown]
        beyond = unseen.error - there @ fitted.values
        many = np.log(choices) + 1 if group.single else len(fitted.values) / 2
        tried.append((group, fitted, e - explained, beyond, many))
    if not tried:
        return []
    least = min((rest for _, _, rest, _, _ in tried), key=lambda r: float(r @ r))
    effective = len(e) / memory_of(least, table.stretch[searched.chosen])
    found = []
    for group, fitted, rest, beyond, many in tried:
        share = float(np.clip((square - float(rest @ rest)) / max(square, len(e)), 0.0, 1 - 1e-9))
        nats = -0.5 * np.log(1 - share) - many / effective
        held = _log_ratio(unseen.error, beyond)
        name = group.name.format(j=joint + 1)
        found.append(Leftover(joint, name, float(min(nats, held)), share, fitted.place))
    return found


def _rows(
    table: Table,
    now: Fit,
    joint: int,
    pl: Places,
    chosen: NDArray[np.bool_],
    residual: Array,
) -> _Rows:
    sigma = now.sigma[joint][table.region[chosen, joint]]
    nominal = pl.of(table.columns[joint][chosen]) / sigma[:, None]
    return _Rows(chosen, sigma, nominal, residual[chosen] / sigma)


def _log_ratio(before: Array, after: Array) -> float:
    """Nats per sample by which a residual is smaller."""
    if len(before) == 0:
        return np.inf
    squares = [max(float(np.mean(e**2)), 1e-12) for e in (before, after)]
    return 0.5 * float(np.log(squares[0] / squares[1]))


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
