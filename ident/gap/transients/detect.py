"""Detect transients: short intervals with excess residual power.

The interval is the one whose rows gain the most log-likelihood from a noise variance of their own
(a scan statistic for a change of variance).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.blocks import EXCLUDED, FOLDS
from ident.gap.data.noise_regions import Region
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.residuals import Residual, residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import Fit, fit
from ident.gap.settings import Transients
from ident.signals.arrays import Array

_LENGTHS_S = tuple(np.geomspace(0.2, 4.0, 16))  # tried intervals: from a blow to a slow push
_ROUNDS = 2  # of finding the interval and fitting without it
_RECTANGLE = 3**-0.5  # standard deviation of what lies anywhere within one (JCGM 100:2008, 4.3.7)


@dataclass(frozen=True)
class Transient:
    """An interval of time that the model does not explain.

    Attributes:
        log: number of the recording, from 0.
        start_s, end_s: since the recording's first sample.
        joints: affected joints, from 0.
        torque: mean residual torque on each of them [N m].
        sd: its standard deviation, where a mean over as long elsewhere is anything up to the
            largest one: a wrong model has its own peaks.
        gain: log-likelihood gained by giving the interval a noise of its own [nats per sample].
        rows: rows inside the interval, shape (R,).
        loudness: mean square of each row in units of the noise elsewhere, shape (R,).
        at_start: whether it begins with the recording: no push is told there from what friction
            still held of the time before.
    """

    log: int
    start_s: float
    end_s: float
    joints: tuple[int, ...]
    torque: Array
    sd: Array
    gain: float
    rows: NDArray[np.bool_]
    loudness: Array
    at_start: bool = False

    @property
    def deviations(self) -> Array:
        """Size of each joint's torque in standard deviations."""
        return np.divide(
            np.abs(self.torque), self.sd, out=np.full(len(self.sd), np.inf), where=self.sd > 0
        )

    def at_sure_joints(self, z: float) -> "Transient | None":
        """The same at the joints whose torque is this many deviations from zero; None: nowhere."""
        kept = np.flatnonzero((self.deviations >= z) & (not self.at_start))
        joints = tuple(self.joints[i] for i in kept)
        return (
            replace(self, joints=joints, torque=self.torque[kept], sd=self.sd[kept])
            if joints
            else None
        )

    def repeats_with_motion(
        self, repeats: tuple[NDArray[np.int64], NDArray[np.int64]], share: float
    ) -> bool:
        """Whether the excess power comes back when the motion is repeated: then it is no event.

        Args:
            repeats: rows of one period, and the same rows of the next, see `repeated_rows`.
            share: of the excess power that counts as coming back.
        """
        first, second = (np.concatenate(order) for order in (repeats, repeats[::-1]))
        known = self.rows[first] & ~self.rows[second]
        if not known.any():
            return False
        usual = np.median(self.loudness[~self.rows])
        here, again = (self.loudness[rows[known]].mean() - usual for rows in (first, second))
        return bool(again > share * here)


def find_transient(
    rows: WindowedRows, current: CurrentFit, settings: Transients
) -> Transient | None:
    """The interval whose removal makes the residual of the rest smallest; None without one.

    Rows that are excluded already are not looked at.
    """
    design = current.design(rows)
    log, usual, structure = rows.log, current.fit, current.fit.structure
    chosen = np.zeros(0, dtype=bool)
    for _ in range(_ROUNDS):
        power = _power(design, usual)
        found = _loudest_interval(power, log, design.t, (rows.hop_s, settings.span_ratio))
        if found is None:
            return None
        chosen = _extended(found, power, log, settings.loudness)
        rest = design.with_folds(np.where(chosen, EXCLUDED, design.fold))
        usual = fit(rest.equations.of(range(FOLDS)), structure, usual.sigma)
    squares, count = _power(design, usual)
    left = residuals(design, usual)
    joints, torque, sd = _affected(left, usual, chosen, settings)
    if not joints:
        return None
    before = fit(design.equations.of(range(FOLDS)), structure, current.fit.sigma)
    t, number = design.t[chosen], int(log[chosen][0])
    return Transient(
        number,
        float(t.min()),
        float(t.max()),
        joints,
        torque,
        sd,
        _gain(before, usual, left, chosen, settings),
        chosen,
        squares / np.maximum(count, 1.0),
        bool(t.min() < design.t[log == number].min() + rows.hop_s),
    )


def with_affected_joints(
    rows: WindowedRows,
    transients: Sequence[Transient],
    current: CurrentFit,
    settings: Transients,
) -> list[Transient]:
    """The transients with affected joints and torques beside the current model."""
    left = residuals(current.design(rows), current.fit)
    found = []
    for b in transients:
        joints, torque, sd = _affected(left, current.fit, b.rows, settings)
        found.append(replace(b, joints=joints, torque=torque, sd=sd) if joints else b)
    return found


def at_end_stop(
    rows: WindowedRows, transients: Sequence[Transient], settings: Transients
) -> tuple[int, ...]:
    """Joints whose transients all occur beyond every transient-free position: likely an end stop.

    Needs at least two transients: one alone may be a coincidence.
    """
    if len(transients) < 2:
        return ()
    log = np.concatenate([np.full(len(s.t), s.log) for s in rows.segments])
    t = np.concatenate([s.t for s in rows.segments])
    inside = np.array([(log == b.log) & (b.start_s <= t) & (t <= b.end_s) for b in transients])
    q = np.concatenate([s.q for s in rows.segments])
    speed = np.abs(np.concatenate([s.qd for s in rows.segments]))
    sliding = speed > settings.sliding_speed
    return tuple(
        j
        for j in sorted(set.intersection(*(set(b.joints) for b in transients)))
        for x in (q[:, j], -q[:, j])
        if _reach(x, sliding[:, j] & ~inside.any(axis=0)) + settings.end_margin * np.ptp(x)
        < min(_reach(x, sliding[:, j] & here) for here in inside)
    )


def _reach(x: Array, chosen: NDArray[np.bool_]) -> float:
    return float(x[chosen].max(initial=-np.inf))


def _affected(
    left: Sequence[Residual], usual: Fit, chosen: NDArray[np.bool_], settings: Transients
) -> tuple[tuple[int, ...], Array, Array]:
    """Joints with a loud residual while they slide, its mean on each [N m], and that mean's sd.

    A joint at rest tells nothing: dry friction answers a push up to its own size.
    """
    noise = _noise(usual, settings)[:, int(Region.SLIDING)]
    torque, sd = {}, []
    for j, r in enumerate(left):
        inside = r.values[chosen & _slides(r)] if len(r.values) else r.values
        if len(inside) and _mean_square(inside) > settings.loudness * noise[j] ** 2:
            torque[j] = float(inside.mean())
            elsewhere = r.values[~chosen & ~r.excluded & _slides(r)]
            sd.append(_RECTANGLE * _largest_mean(elsewhere, len(inside)))
    return tuple(torque), np.array(list(torque.values())), np.array(sd)


def _largest_mean(values: Array, count: int) -> float:
    """Largest mean of so many values in a row, by size; zero where there are fewer."""
    usable = len(values) // count * count
    return float(np.abs(values[:usable].reshape(-1, count).mean(axis=1)).max(initial=0.0))


def _slides(r: Residual) -> NDArray[np.bool_]:
    return r.region != Region.REVERSAL


def _noise(usual: Fit, settings: Transients) -> Array:
    """Usual noise of each joint and region, or the least torque that counts [N m], shape (n, 3)."""
    least = settings.friction_share * np.abs(usual.coulomb)
    return np.maximum(usual.sigma, least[:, None])


def _mean_square(values: Array) -> float:
    return float(np.mean(values**2))


def _power(design: DesignMatrix, usual: Fit) -> tuple[Array, Array]:
    """Squared residuals of all sliding joints in units of their noise, and how many slide, (R,)."""
    total, joints = np.zeros(len(design.t)), np.zeros(len(design.t))
    for j, r in enumerate(residuals(design, usual)):
        if len(r.values):
            sliding = _slides(r) & ~r.excluded
            total += np.where(sliding, (r.values / usual.sigma[j][r.region]) ** 2, 0.0)
            joints += sliding
    return total, joints


def _loudest_interval(
    power: tuple[Array, Array], log: NDArray[np.int64], t: Array, spacing: tuple[float, float]
) -> NDArray[np.bool_] | None:
    """The interval with the largest likelihood ratio for a variance of its own, shape (R,).

    For m values of mean square r it is m (r - 1 - log r), twice the log-likelihood's rise.

    Args:
        power: squared residuals in units of their noise, and the joints that slide, (R,) each.
        log: recording of each row, shape (R,).
        t: of each row [s], shape (R,).
        spacing: of the rows [s], and times its length that an interval's rows may span.
    """
    hop_s, span = spacing
    best, chosen = 0.0, None
    sums = [np.concatenate([[0.0], np.cumsum(p)]) for p in power]
    for length in _LENGTHS_S:
        width = max(2, round(length / hop_s))
        if width >= len(t):
            break
        squares, joints = (s[width:] - s[:-width] for s in sums)
        same = log[width - 1 :] == log[: len(log) - width + 1]
        close = t[width - 1 :] - t[: len(t) - width + 1] < span * length + hop_s
        usable = same & close & (squares > joints) & (joints > 0)
        ratio = np.where(usable, squares / np.maximum(joints, 1.0), 1.0)
        value = joints * (ratio - 1.0 - np.log(ratio))
        if value.max() > best:
            best, start = float(value.max()), int(value.argmax())
            chosen = np.zeros(len(t), dtype=bool)
            chosen[start : start + width] = True
    return chosen


def _extended(
    chosen: NDArray[np.bool_], power: tuple[Array, Array], log: NDArray[np.int64], loudness: float
) -> NDArray[np.bool_]:
    """The interval extended by the loud rows beside it, and by one quiet row at each end."""
    inside = np.flatnonzero(chosen)
    loud = power[0] > loudness * np.maximum(power[1], 1.0)
    usable = log == log[inside[0]]
    ends = []
    for row, step in ((inside[0], -1), (inside[-1], 1)):
        while 0 <= row + step < len(usable) and usable[row + step] and loud[row + step]:
            row += step
        beyond = row + step
        ends.append(beyond if 0 <= beyond < len(usable) and usable[beyond] else row)
    extended = np.zeros_like(chosen)
    extended[ends[0] : ends[1] + 1] = True
    return extended


def _gain(
    before: Fit,
    usual: Fit,
    left: list[Residual],
    chosen: NDArray[np.bool_],
    settings: Transients,
) -> float:
    """Sum over joints of the mean log ratio, with a noise of its own in the interval."""
    old, new = _noise(before, settings), _noise(usual, settings)
    gain = 0.0
    for j, r in enumerate(left):
        inside = chosen & _slides(r) if len(r.values) else np.zeros(0, dtype=bool)
        if not inside.any():
            continue
        sliding = slice(int(Region.SLIDING), None)
        total = np.log(old[j, sliding]) @ before.counts[j, sliding]
        total -= np.log(new[j, sliding]) @ usual.counts[j, sliding]
        transient = np.sqrt(_mean_square(r.values[inside])) + new[j].min()
        gain += (total - np.log(transient) * inside.sum()) / before.counts[j].sum()
    return float(gain)
