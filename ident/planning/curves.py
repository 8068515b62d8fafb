"""What has no name as measured curves: over every variable that the test for lack of fit asks of.

The one periodic in time is left out: the phase of another recording is not known before it.
"""

import functools
from collections.abc import Iterator, Sequence

import numpy as np

from ident.effects.candidate import Candidate
from ident.effects.measured_effect import ACROSS, KNOTS, PERIODIC, VARIANTS, curve_over
from ident.effects.observation import Observed
from ident.gap.data.blocks import SEARCHED
from ident.gap.lack_of_fit.basis_functions import FreeCurves, Range, sines, wave_numbers
from ident.gap.regression.current_model import CurrentFit, extend
from ident.gap.regression.projection import joint_rows, projected
from ident.gap.regression.residuals import residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.selection.candidates import examine
from ident.gap.selection.scoring import Score
from ident.gap.settings import GapSettings
from ident.signals.arrays import Array

MOST = 3
"""So many curves at most: what a model lacks may act along two variables, seldom along more."""

_FINE = 25
"""Corners of a fine curve over a joint's position, which may change within a tenth of its range."""


def curves(rows: WindowedRows, joint: int) -> list[Candidate]:
    """Curves over a joint's own motion (from 0), over what the recordings hold of its variables.

    They go on by half a segment beyond, since another motion may go a little further; what
    multiplies a velocity ends where there was any.
    """
    segments = rows.segments
    q, qd = (np.concatenate([x[:, joint] for x in m]) for m in _motion(rows))
    fast = float(np.abs(qd).max())
    ends = {
        "position": _further(q),
        "position velocity": _where_moved(q, qd),
        "speed": (0.0, fast * (KNOTS - 1) / (KNOTS - 1.5)),
        "time": (0.0, float(max(s.t[-1] for s in segments))),
    }
    return [curve_over(v, (joint,), ends.get(v) or ends[v.split()[0]]) for v in VARIANTS]


def all_curves(rows: WindowedRows, current: CurrentFit, joint: int) -> list[Candidate]:
    """Those, finer ones, the likeliest over a period of the angle, and those over other joints."""
    moving = [i for i in current.model.facts.moving_joints if i != joint]
    found = [*curves(rows, joint), *_periodic(rows, current, joint)]
    q, qd = (np.concatenate(m) for m in _motion(rows))
    within = _further(q[:, joint], _FINE)
    fine = {"position": within, "position direction": within}
    fine["position velocity"] = _where_moved(q[:, joint], qd[:, joint])
    found += [curve_over(v, (joint,), ends, _FINE) for v, ends in fine.items()]
    for i in moving:
        ends = {
            "other position": _further(q[:, i]),
            "other velocity": _further(qd[:, i]),
            "other velocity velocity": _where_moved(qd[:, i], qd[:, joint]),
        }
        found += [curve_over(v, (joint, i), ends[v]) for v in ACROSS]
    return found


def with_curves(
    rows: WindowedRows, current: CurrentFit, joint: int, settings: GapSettings
) -> CurrentFit | None:
    """A model with the curves that explain most at a joint (from 0); None: none explains anything.

    One after the other, as long as one more explains what any effect has to.
    """
    most = len(current.accepted) + MOST
    start = current
    while len(current.accepted) < most:
        best = best_curve(rows, current, all_curves(rows, current, joint), settings)
        least = settings.thresholds.min_gain if current is not start else 0.0
        if best is None or best.penalised_gain < least:
            break
        current = extend(rows, current, [best.candidate])
    return None if current is start else current


def best_curve(
    rows: WindowedRows, current: CurrentFit, tried: Sequence[Candidate], settings: GapSettings
) -> Score | None:
    """The curve that explains most beside a model."""
    return next(iter(examine(rows, current, tried, settings.scoring)[1]), None)


def _motion(rows: WindowedRows) -> tuple[list[Array], list[Array]]:
    return [s.q for s in rows.segments], [s.qd for s in rows.segments]


def _where_moved(x: Array, velocity: Array) -> tuple[float, float]:
    """Ends of a variable, less the hundredth at each that the joint hardly moved at."""
    order = np.argsort(x)
    share = np.cumsum(velocity[order] ** 2)
    low, high = np.interp([0.01 * share[-1], 0.99 * share[-1]], share, x[order])
    return float(low), float(high)


def _further(x: Array, knots: int = KNOTS) -> tuple[float, float]:
    """Ends of a variable, and half a segment of its curve beyond each."""
    low, high = float(x.min()), float(x.max())
    further = (high - low) / (2 * (knots - 2))
    return low - further, high + further


def _periodic(rows: WindowedRows, current: CurrentFit, joint: int) -> Iterator[Candidate]:
    """The curve over the joint's angle whose waves explain most of what is left, if any."""
    q = np.concatenate(_motion(rows)[0])[:, joint]
    step = np.pi / (2 * float(np.ptp(q)))
    numbers = np.arange(6 * step, wave_numbers()[-1], step)
    if len(numbers) == 0:
        return
    design, observed = current.design(rows), FreeCurves(rows, current.model)
    left = residuals(design, current.fit)[joint].values
    here = joint_rows(design, current.fit, joint, np.isin(design.fold, SEARCHED), left)

    def strongest(numbers: Array) -> float:
        formed = observed.windowed(functools.partial(_waves, joint=joint, numbers=numbers))[0]
        found = projected(current.fit, here, formed).fitted(here.error, single=True)
        return float(numbers[int(np.abs(found.values).argmax()) // 2])

    best = strongest(strongest(numbers) + step * np.linspace(-1.0, 1.0, 21))
    low = float(q.min())
    yield curve_over(PERIODIC, (joint,), (low, low + 2 * np.pi / best))


def _waves(seen: Observed, extent: Range, joint: int, numbers: Array) -> list[Array]:
    return [sines(np.outer(seen.q[:, joint], numbers))]
