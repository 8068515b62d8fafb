"""A load that the arm carries for a part of the recording only, such as a part that it picked up.

Beside the arm itself a mass at the last link is fitted that is there from one moment to another:
the two moments between which it explains most of what no rigid arm explains. It has to be one load:
another one in each half of that time explains hardly more, as it does where the arm's description
is wrong. Friction that differs between the two moments is its rival, and so is one factor of all
torque, as where the unit, a gain or the supply changes.
"""

from dataclasses import dataclass

import numpy as np

from ident.checks.case import Case
from ident.checks.gains import last_link
from ident.checks.remark import Grade, Remark
from ident.checks.settings import CheckSettings
from ident.regression.probe_fit import solution
from ident.signals.arrays import Array

_PARTS = 36
"""Of the recording: its time is searched in such steps."""

_LEAST_PARTS = 3
"""That a load is there, and that it is not."""

_TO_THE_END = 0.95
"""Of the best interval's gain: one that lasts to the end and has so much is the simpler answer."""

_CLEARLY = 0.75
"""Of what a load leaves: where one factor of all torque leaves less, that is told instead."""

_FARTHEST_M = 1.0
"""Of the load's centre from the last link's frame."""

_ADVICE = (
    "Record again with one load throughout, or cut the recording there and identify the parts by"
    " themselves."
)

_ADVICE_ON_FACTOR = (
    "Check what changes the torque's unit, a gain or the drives' supply there, or cut the recording"
    " there and identify the parts by themselves."
)


@dataclass(frozen=True)
class _Interval:
    """What columns explain that count from one moment to another only.

    Attributes:
        start, end: parts of the recording's time, in `_PARTS`.
        gain: share of the squared residual that they explain.
        size: of each column, shape (k,).
    """

    start: int
    end: int
    gain: float
    size: Array


def load_change_remarks(case: Case, bounds: CheckSettings) -> list[Remark]:
    """Whether a load that comes or goes explains most of what is left of the torque, or a factor.

    Args:
        case: one recording.
        bounds: of the checks.
    """
    part = _part_of(case)
    if len(np.unique(part)) < _PARTS:
        return []
    load = last_link(case)[:, :, [9, 6, 7, 8]]
    left, best = _best(case, part, load)
    mass, moment = float(best.size[0]), float(np.linalg.norm(best.size[1:]))
    share = float(np.sqrt(left / max(np.sum(case.columns.tau**2), 1e-300)))
    possible = moment <= _FARTHEST_M * abs(mass)
    if not possible or best.gain < bounds.load_share or share < bounds.load_error:
        return []
    inside = (part >= best.start) & (part < best.end)
    frozen = np.ptp(case.probe.raw[inside], axis=0) == 0.0
    if (frozen & case.probe.moving).any() or _by_halves(case, part, load, best, left) > (
        bounds.load_halves * best.gain
    ):
        return []
    friction = case.columns.W[:, :, case.columns.friction.ravel()]
    rivals = _intervals(case, part, friction)[1]
    if best.gain < bounds.load_over_friction * max(i.gain for i in rivals):
        return []
    factor = _best(case, part, _explained(case)[:, :, None])[1]
    ratio = (1.0 - factor.gain) / max(1.0 - best.gain, 1e-9)
    is_load = ratio > _CLEARLY
    told, words = (best, _load_in_words) if is_load else (factor, _factor_in_words)
    figures = f"the error of the fit then falls from {100 * share:.3g} to"
    figures += f" {100 * share * np.sqrt(1.0 - told.gain):.3g} %"
    finding = f"{_when(case, told)} {words(told)} ({figures})"
    if is_load and ratio < 1.0 / _CLEARLY:
        finding += f", or else {_factor_in_words(factor)}"
    code, advice = ("load_changes", _ADVICE) if is_load else ("units", _ADVICE_ON_FACTOR)
    return [Remark(code, (), f"{finding}.", Grade.DOUBTFUL, advice)]


def _best(case: Case, part: Array, columns: Array) -> tuple[float, _Interval]:
    """The squared residual without columns, and the time in which they explain most of it."""
    left, found = _intervals(case, part, columns)
    best = max(found, key=lambda i: i.gain)
    last = max((i for i in found if i.end == _PARTS), key=lambda i: i.gain)
    return left, last if last.gain >= _TO_THE_END * best.gain else best


def _explained(case: Case) -> Array:
    """Torque of the arm that fits all of the recording, shape (S, n)."""
    W = case.columns.W
    rows = W.reshape(-1, W.shape[2])
    return W @ solution(rows.T @ rows, rows.T @ case.columns.tau.ravel())


def _when(case: Case, found: _Interval) -> str:
    t = case.probe.t
    start, end = (t[0] + k / _PARTS * (t[-1] - t[0]) for k in (found.start, found.end))
    if found.end < _PARTS:
        return f"From about {start:.3g} to {end:.3g} s"
    return f"From about {start:.3g} s on"


def _load_in_words(found: _Interval) -> str:
    mass = float(found.size[0])
    centre = np.linalg.norm(found.size[1:] / mass)
    more = "more" if mass > 0 else "less"
    return (
        f"the last link appears to carry {float(f'{abs(mass):.2g}'):g} kg {more},"
        f" {centre:.2g} m from its frame"
    )


def _factor_in_words(found: _Interval) -> str:
    return (
        f"the torque of all joints appears to be {1.0 + float(found.size[0]):.3g} times as large as"
        " the same motion needs at other times"
    )


def _part_of(case: Case) -> Array:
    """Which part of the recording's time each instant lies in, shape (S,)."""
    t = case.probe.t
    return np.minimum((_PARTS * (t - t[0]) / max(np.ptp(t), 1e-9)).astype(int), _PARTS - 1)


def _by_halves(case: Case, part: Array, load: Array, found: _Interval, left: float) -> float:
    """Share of the squared residual that a load of its own explains in each half of the interval.

    And in what comes after it, or in half of what comes before it.
    """
    middle = (found.start + found.end) // 2
    rest = (found.end, _PARTS) if found.end < _PARTS else (0, found.start // 2)
    times = (found.start, middle), (middle, found.end), rest
    each = [load * ((part >= a) & (part < b))[:, None, None] for a, b in times]
    rows = np.concatenate([case.columns.W, *each], axis=2)
    rows, goal = rows.reshape(-1, rows.shape[2]), case.columns.tau.ravel()
    residual = goal - rows @ solution(rows.T @ rows, rows.T @ goal)
    return 1.0 - float(residual @ residual) / left


def _intervals(case: Case, part: Array, columns: Array) -> tuple[float, list[_Interval]]:
    """What columns explain that count in an interval only, beside the arm throughout.

    Args:
        case: one recording.
        part: of the time, for each instant, shape (S,).
        columns: shape (S, n, k).

    Returns:
        the squared residual of the arm alone, and all intervals that begin after the start.
    """
    W, tau = case.columns.W, case.columns.tau
    p, k = W.shape[2], columns.shape[2]
    rows = np.concatenate([W, columns, tau[:, :, None]], axis=2)
    grams = np.zeros((_PARTS + 1, p + k + 1, p + k + 1))
    for i in range(_PARTS):
        own = rows[part == i].reshape(-1, p + k + 1)
        grams[i + 1] = grams[i] + own.T @ own
    A, y, size = grams[-1][:p, :p], grams[-1][:p, -1], grams[-1][-1, -1]
    arm = solution(A, y)
    left = max(float(size - 2 * y @ arm + arm @ A @ arm), 1e-300)
    found = []
    for a in range(1, _PARTS - _LEAST_PARTS + 1):
        for b in range(a + _LEAST_PARTS, _PARTS + 1):
            inside = grams[b] - grams[a]
            shared = inside[p : p + k, :p]
            own = inside[p : p + k, p : p + k] - shared @ solution(A, shared.T)
            goal = inside[p : p + k, -1] - shared @ arm
            x = solution(own, goal)
            found.append(_Interval(a, b, float(x @ goal) / left, x))
    return left, found
