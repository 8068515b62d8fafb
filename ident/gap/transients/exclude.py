"""Transients of torque that no other effect explains: set apart before effects are named."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.effects.events import CONTACT
from ident.gap.data.experiment import Experiment
from ident.gap.lack_of_fit.repeatability import pairs
from ident.gap.regression.current_model import CurrentFit, extend
from ident.gap.regression.design_matrix import WindowedRows, build_design_matrix
from ident.gap.regression.residuals import residuals
from ident.gap.selection.state import SelectionState
from ident.gap.transients.detect import Transient, find_transient

Array = NDArray[np.floating]

_BESIDE = 0.25  # of an effect's gain: what a transient beside it must bring
_MOST = 12
_MUCH = 0.2  # of the data: an event takes less
_SETTLED = 10.0  # bristle's distances: after so long a way nothing is left of where it began
_STRIKES = 4.0  # times its usual mean square: an effect that acts in blows
_DIRECTED = 0.2  # of its mean square: the squared mean of a push, which is 0.8 for half a sine
_PART = 0.1  # of the residual's mean square: a third of its size
_NEAR_S = 0.5  # what begins so soon after a transient is its end


def exclude_transients(
    source: Experiment, way: SelectionState, larger: CurrentFit, best: float
) -> bool:
    """Exclude transients that stand out beside the next effects; whether any was excluded.

    Without such effects one must explain more than any other; with them a good part of theirs: what
    they leave in a few places because their form is another one is no transient. Nor is what comes
    again with the motion.
    """
    if not way.may_cut:
        return False
    alone, cut = larger is way.present, False
    least = max(best if alone else _BESIDE * best, way.threshold.of(CONTACT.id))
    for _ in range(_MOST - len(way.transients)):
        transient = _loud(way.rows, larger)
        if transient is None or transient.gain < least:
            break
        table = build_design_matrix(way.rows, larger.model, ())
        if transient.repeats_with_motion(pairs(source, way.rows, table)) or in_presliding_transient(
            way.rows, larger, transient
        ):
            break
        if explained_by_accepted(way.rows, larger, transient):
            break
        way.transients = _joined(way.transients, transient)
        way.rows = replace(way.rows, apart=np.any([b.rows for b in way.transients], axis=0))
        way.present = extend(way.rows, way.present, ())
        larger = way.present if alone else extend(way.rows, larger, ())
        cut = True
    return cut


def in_presliding_transient(rows: WindowedRows, present: CurrentFit, transient: Transient) -> bool:
    """Whether a joint that gives way like a bristle has hardly moved yet: its state is not known.

    Every segment begins somewhere between the bristle's ends.
    """
    distances = {
        h.joints[0]: distance
        for h in present.accepted
        if (distance := catalogue()[h.effect].memory_distance(h))
        and h.joints[0] in transient.joints
    }
    for s in rows.segments:
        inside = (s.t >= transient.start_s) & (s.t <= transient.end_s)
        if s.log != transient.log or not inside.any():
            continue
        end = int(np.flatnonzero(inside)[-1])
        path = np.abs(np.diff(s.q[: end + 1], axis=0)).sum(axis=0)
        if any(path[j] < _SETTLED * distance for j, distance in distances.items()):
            return True
    return False


def explained_by_accepted(rows: WindowedRows, present: CurrentFit, transient: Transient) -> bool:
    """Whether an accepted impact-like effect explains the transient.

    A link that meets the end of its play gives a blow of nearly, but not quite, the right form. One
    that swings on its spring leaves what changes its sign; a push has a direction.
    """
    table = build_design_matrix(rows, present.model, present.accepted)
    left = residuals(table, present.fit)
    for i, (h, values) in enumerate(zip(present.accepted, present.fit.effects, strict=True)):
        joint, slot = h.joints[0], table.slots[i]
        if (
            catalogue()[h.effect].form_uncertainty is not FormUncertainty.ANY
            or joint not in transient.joints
        ):
            continue
        first = table.grams.layouts[joint].first_extra + slot.starts[slot.joints.index(joint)]
        torque = table.columns[joint][:, first : first + slot.width] @ values
        here, usual = _mean_square(torque[transient.rows]), _mean_square(torque[~transient.rows])
        if all(_oscillates(left[j].values[transient.rows]) for j in transient.joints):
            return True
        if here > max(_STRIKES * usual, _PART * _mean_square(left[joint].values[transient.rows])):
            return True
    return False


def _oscillates(values: Array) -> bool:
    return float(values.mean()) ** 2 < _DIRECTED * _mean_square(values)


def _mean_square(values: Array) -> float:
    return float(np.mean(values**2))


def _joined(transients: list[Transient], transient: Transient) -> list[Transient]:
    """The transients with one more, which may be an end of one of them, in order of time."""
    for i, b in enumerate(transients):
        gap = max(transient.start_s - b.end_s, b.start_s - transient.end_s)
        if b.log == transient.log and gap < _NEAR_S:
            start, end = min(b.start_s, transient.start_s), max(b.end_s, transient.end_s)
            whole = replace(b, start_s=start, end_s=end, rows=b.rows | transient.rows)
            return [*transients[:i], whole, *transients[i + 1 :]]
    return sorted([*transients, transient], key=lambda b: (b.log, b.start_s))


def still_significant(way: SelectionState) -> bool:
    """Whether transients still stand out from the model with all effects.

    Where there seems to be no end to them they are no events.
    """
    apart = way.rows.apart
    if apart is None or len(way.transients) >= _MOST or apart.mean() > _MUCH:
        return False
    transient = _loud(replace(way.rows, apart=None), way.present)
    least = way.threshold.of(CONTACT.id)
    return (
        transient is not None and transient.gain >= least and bool((transient.rows & apart).any())
    )


def _loud(rows: WindowedRows, present: CurrentFit) -> Transient | None:
    table = build_design_matrix(rows, present.model, present.accepted)
    return find_transient(rows, table, present.fit, present.fit.choice)
