"""A transient in the residual: a segment of time in which the model fails, and never else."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.noise_regions import Region
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import (
    EXCLUDED,
    FOLDS,
    Table,
    WindowedRows,
    build_design_matrix,
)
from ident.gap.regression.normal_equations import joint_products
from ident.gap.regression.residuals import Residual, residuals
from ident.gap.regression.weighted_fit import Fit, ModelStructure, fit

Array = NDArray[np.floating]

_LENGTHS_S = tuple(np.geomspace(0.2, 4.0, 16))
_ROUNDS = 2
_AGAIN = 0.1  # of a transient's square above the usual, in another period: it comes with the motion
_FARTHER = 0.01  # of its range: so much more than ever else is a place of its own
_SLIDES = 0.05  # rad/s: a slower joint may lean on something and show nothing
_SHARP = 9.0  # a joint takes part where its mean square in the transient is so many times the usual


@dataclass(frozen=True)
class Transient:
    """A segment of time that the model does not explain.

    Attributes:
        log: number of the recording, from 0.
        start_s, end_s: since the recording's first sample.
        joints: the joints that feel it, from 0.
        torque: mean torque on each of them [N m].
        gain: drop of the mean log residual when the segment has a noise of its own [nats].
        rows: which rows of the table lie in it, shape (R,).
        loudness: mean square of each row in units of the noise without it, shape (R,).
    """

    log: int
    start_s: float
    end_s: float
    joints: tuple[int, ...]
    torque: Array
    gain: float
    rows: NDArray[np.bool_]
    loudness: Array

    def repeats_with_motion(self, repeats: tuple[NDArray[np.int64], NDArray[np.int64]]) -> bool:
        """Whether the model fails as well where the motion is the same in another period.

        What comes again with the motion is no event.

        Args:
            repeats: rows of one period, and the same rows of the next, see `repeats.pairs`.
        """
        first, second = (np.concatenate(way) for way in (repeats, repeats[::-1]))
        known = self.rows[first] & ~self.rows[second]
        if not known.any():
            return False
        usual = np.median(self.loudness[~self.rows])
        here, again = (self.loudness[rows[known]].mean() - usual for rows in (first, second))
        return bool(again > _AGAIN * here)


def find_transient(
    rows: WindowedRows, table: Table, now: Fit, choice: ModelStructure
) -> Transient | None:
    """The segment whose removal makes the residual of the rest smallest, if any stands out.

    Rows that stand apart already are not looked at.
    """
    log = np.array([s.log for s in rows.segments])[table.segment]
    usual = now
    chosen = None
    outside = table
    for _ in range(_ROUNDS):
        power = _power(table, usual)
        chosen = _loudest(power, log, table.t, rows.windows.hop / rows.windows.rate_hz)
        if chosen is None:
            return None
        outside = without(table, chosen)
        usual = fit(outside.grams.of(range(FOLDS)), choice, usual.sigma)
    if chosen is None:
        return None
    squares, count = _power(table, usual)
    left = residuals(table, usual)
    joints, torque = _felt(left, usual, chosen)
    if not joints:
        return None
    before = fit(table.grams.of(range(FOLDS)), choice, now.sigma)
    t = table.t[chosen]
    return Transient(
        int(log[chosen][0]),
        float(t.min()),
        float(t.max()),
        joints,
        torque,
        _gain(before, usual, left, chosen),
        chosen,
        squares / np.maximum(count, 1.0),
    )


def felt(rows: WindowedRows, transients: Sequence[Transient], now: CurrentFit) -> list[Transient]:
    """The transients with the joints that feel them, and their torque, beside the model so far."""
    left = residuals(build_design_matrix(rows, now.model, now.accepted), now.fit)
    found = []
    for b in transients:
        joints, torque = _felt(left, now.fit, b.rows)
        found.append(replace(b, joints=joints, torque=torque) if joints else b)
    return found


def at_end_stop(rows: WindowedRows, transients: Sequence[Transient]) -> tuple[int, ...]:
    """Joints whose transients all occur beyond every transient-free position: likely an end stop.

    One passage alone tells nothing; several, of which no other is free of it, are no chance.
    """
    if len(transients) < 2:
        return ()
    log = np.concatenate([np.full(len(s.t), s.log) for s in rows.segments])
    t = np.concatenate([s.t for s in rows.segments])
    inside = np.array([(log == b.log) & (b.start_s <= t) & (t <= b.end_s) for b in transients])
    q = np.concatenate([s.q for s in rows.segments])
    sliding = np.abs(np.concatenate([s.qd for s in rows.segments])) > _SLIDES
    return tuple(
        j
        for j in sorted(set.intersection(*(set(b.joints) for b in transients)))
        for x in (q[:, j], -q[:, j])
        if _reach(x, sliding[:, j] & ~inside.any(axis=0)) + _FARTHER * np.ptp(x)
        < min(_reach(x, sliding[:, j] & here) for here in inside)
    )


def _reach(x: Array, chosen: NDArray[np.bool_]) -> float:
    return float(x[chosen].max(initial=-np.inf))


def _felt(
    left: Sequence[Residual], now: Fit, chosen: NDArray[np.bool_]
) -> tuple[tuple[int, ...], Array]:
    """The joints whose residual is loud in some rows, and its mean on each of them [N m]."""
    calm = now.sigma[:, int(Region.SLIDING)]
    loud = [float(np.mean(r.values[chosen] ** 2)) if len(r.values) else 0.0 for r in left]
    joints = tuple(j for j, x in enumerate(loud) if x > _SHARP * calm[j] ** 2)
    return joints, np.array([left[j].values[chosen].mean() for j in joints])


def _power(table: Table, usual: Fit) -> tuple[Array, Array]:
    """Squared residual of all sliding joints in units of their noise, and their number, (R,)."""
    total, joints = np.zeros(len(table.t)), np.zeros(len(table.t))
    for j, r in enumerate(residuals(table, usual)):
        if len(r.values):
            sliding = (r.region != Region.REVERSAL) & ~r.apart
            total += np.where(sliding, (r.values / usual.sigma[j][r.region]) ** 2, 0.0)
            joints += sliding
    return total, joints


def _loudest(
    power: tuple[Array, Array], log: NDArray[np.int64], t: Array, step: float
) -> NDArray[np.bool_] | None:
    """The window that a noise of its own makes most likely (twice the log-likelihood's rise)."""
    best, chosen = 0.0, None
    sums = [np.concatenate([[0.0], np.cumsum(p)]) for p in power]
    for length in _LENGTHS_S:
        width = max(2, round(length / step))
        if width >= len(t):
            break
        squares, joints = (s[width:] - s[:-width] for s in sums)
        same = log[width - 1 :] == log[: len(log) - width + 1]
        close = t[width - 1 :] - t[: len(t) - width + 1] < 1.5 * length + step
        usable = same & close & (squares > joints) & (joints > 0)
        ratio = np.where(usable, squares / np.maximum(joints, 1.0), 1.0)
        value = joints * (ratio - 1.0 - np.log(ratio))
        if value.max() > best:
            best, start = float(value.max()), int(value.argmax())
            chosen = np.zeros(len(t), dtype=bool)
            chosen[start : start + width] = True
    return None if chosen is None else _whole(chosen, power, log)


def _whole(
    chosen: NDArray[np.bool_], power: tuple[Array, Array], log: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """The window with the loud rows beside it, and one more at each end, in the same recording."""
    inside = np.flatnonzero(chosen)
    loud = power[0] > _SHARP * np.maximum(power[1], 1.0)
    usable = log == log[inside[0]]
    ends = []
    for row, way in ((inside[0], -1), (inside[-1], 1)):
        while 0 <= row + way < len(usable) and usable[row + way] and loud[row + way]:
            row += way
        beyond = row + way
        ends.append(beyond if 0 <= beyond < len(usable) and usable[beyond] else row)
    extended = np.zeros_like(chosen)
    extended[ends[0] : ends[1] + 1] = True
    return extended


def without(table: Table, rows: NDArray[np.bool_]) -> Table:
    """The table without some rows, and those that stand apart."""
    products, counts = [], []
    for j, columns in enumerate(table.columns):
        keep = ~rows & (table.fold != EXCLUDED) if len(columns) else np.zeros(0, dtype=bool)
        size = len(columns)
        product, count = joint_products(
            columns[keep],
            table.fold[:size][keep],
            table.region[:size, j][keep],
            (FOLDS, len(Region)),
        )
        products.append(product)
        counts.append(count)
    grams = replace(table.grams, products=tuple(products), counts=np.array(counts))
    return replace(table, grams=grams)


def _gain(before: Fit, usual: Fit, left: list, chosen: NDArray[np.bool_]) -> float:
    """Sum over joints of the mean log ratio, the transient's rows with a noise of their own."""
    gain = 0.0
    for j, r in enumerate(left):
        if not len(r.values):
            continue
        n = before.counts[j].sum()
        transient = np.sqrt(np.mean(r.values[chosen] ** 2)) + usual.sigma[j].min()
        old = (np.log(before.sigma[j]) * before.counts[j]).sum()
        new = (np.log(usual.sigma[j]) * usual.counts[j]).sum() + np.log(transient) * chosen.sum()
        gain += (old - new) / max(n, 1)
    return float(gain)
