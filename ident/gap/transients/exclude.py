"""Bursts of torque that no other effect explains: set apart before effects are named."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.catalogue import catalogue
from ident.effects.effect import Freedom
from ident.gap.data.experiment import Experiment
from ident.gap.lack_of_fit.repeatability import pairs
from ident.gap.regression.current_model import Present, extend
from ident.gap.regression.design_matrix import Nominal, tabulate
from ident.gap.regression.residuals import residuals
from ident.gap.selection.state import Way
from ident.gap.transients.detect import Burst, find_burst

Array = NDArray[np.floating]

_BESIDE = 0.25  # of an effect's gain: what a burst beside it must bring
_MOST = 12
_MUCH = 0.2  # of the data: an event takes less
_SETTLED = 10.0  # bristle's distances: after so long a way nothing is left of where it began
_STRIKES = 4.0  # times its usual mean square: an effect that acts in blows
_DIRECTED = 0.2  # of its mean square: the squared mean of a push, which is 0.8 for half a sine
_PART = 0.1  # of the residual's mean square: a third of its size
_NEAR_S = 0.5  # what begins so soon after a burst is its end


def cut_out(source: Experiment, way: Way, larger: Present, best: float) -> bool:
    """Set bursts apart that stand out from the model with the next effects; whether it was done.

    Without such effects one must explain more than any other; with them a good part of theirs: what
    they leave in a few places because their form is another one is no burst. Nor is what comes
    again with the motion.
    """
    if not way.may_cut:
        return False
    alone, cut = larger is way.present, False
    least = max(best if alone else _BESIDE * best, way.threshold.of("contact"))
    for _ in range(_MOST - len(way.bursts)):
        burst = _loud(way.rows, larger)
        if burst is None or burst.gain < least:
            break
        table = tabulate(way.rows, larger.model, ())
        if burst.recurs(pairs(source, way.rows, table)) or unsettled(way.rows, larger, burst):
            break
        if struck(way.rows, larger, burst):
            break
        way.bursts = _joined(way.bursts, burst)
        way.rows = replace(way.rows, apart=np.any([b.rows for b in way.bursts], axis=0))
        way.present = extend(way.rows, way.present, ())
        larger = way.present if alone else extend(way.rows, larger, ())
        cut = True
    return cut


def unsettled(rows: Nominal, present: Present, burst: Burst) -> bool:
    """Whether a joint that gives way like a bristle has hardly moved yet: its state is not known.

    Every stretch begins somewhere between the bristle's ends.
    """
    distances = {
        h.joints[0]: h.settings["distance"]
        for h in present.accepted
        if h.effect == "presliding" and h.joints[0] in burst.joints
    }
    for s in rows.stretches:
        inside = (s.t >= burst.start_s) & (s.t <= burst.end_s)
        if s.log != burst.log or not inside.any():
            continue
        end = int(np.flatnonzero(inside)[-1])
        path = np.abs(np.diff(s.q[: end + 1], axis=0)).sum(axis=0)
        if any(path[j] < _SETTLED * distance for j, distance in distances.items()):
            return True
    return False


def struck(rows: Nominal, present: Present, burst: Burst) -> bool:
    """Whether an effect of uncertain form acts in a burst as never else: what it leaves is its own.

    A link that meets the end of its play gives a blow of nearly, but not quite, the right form. One
    that swings on its spring leaves what changes its sign; a push has a direction.
    """
    table = tabulate(rows, present.model, present.accepted)
    left = residuals(table, present.fit)
    for i, (h, values) in enumerate(zip(present.accepted, present.fit.effects, strict=True)):
        joint, slot = h.joints[0], table.slots[i]
        if catalogue()[h.effect].freedom is not Freedom.ANY or joint not in burst.joints:
            continue
        first = table.grams.layouts[joint].first_extra + slot.starts[slot.joints.index(joint)]
        torque = table.columns[joint][:, first : first + slot.width] @ values
        here, usual = _mean_square(torque[burst.rows]), _mean_square(torque[~burst.rows])
        if all(_rings(left[j].values[burst.rows]) for j in burst.joints):
            return True
        if here > max(_STRIKES * usual, _PART * _mean_square(left[joint].values[burst.rows])):
            return True
    return False


def _rings(values: Array) -> bool:
    return float(values.mean()) ** 2 < _DIRECTED * _mean_square(values)


def _mean_square(values: Array) -> float:
    return float(np.mean(values**2))


def _joined(bursts: list[Burst], burst: Burst) -> list[Burst]:
    """The bursts with one more, which may be an end of one of them, in order of time."""
    for i, b in enumerate(bursts):
        gap = max(burst.start_s - b.end_s, b.start_s - burst.end_s)
        if b.log == burst.log and gap < _NEAR_S:
            start, end = min(b.start_s, burst.start_s), max(b.end_s, burst.end_s)
            whole = replace(b, start_s=start, end_s=end, rows=b.rows | burst.rows)
            return [*bursts[:i], whole, *bursts[i + 1 :]]
    return sorted([*bursts, burst], key=lambda b: (b.log, b.start_s))


def stays(way: Way) -> bool:
    """Whether bursts still stand out from the model with all effects.

    Where there seems to be no end to them they are no events.
    """
    apart = way.rows.apart
    if apart is None or len(way.bursts) >= _MOST or apart.mean() > _MUCH:
        return False
    burst = _loud(replace(way.rows, apart=None), way.present)
    least = way.threshold.of("contact")
    return burst is not None and burst.gain >= least and bool((burst.rows & apart).any())


def _loud(rows: Nominal, present: Present) -> Burst | None:
    table = tabulate(rows, present.model, present.accepted)
    return find_burst(rows, table, present.fit, present.fit.choice)
