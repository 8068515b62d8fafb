"""Exclude transients from the fit before effects are named."""

from dataclasses import dataclass, replace

import numpy as np

from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.gap.data.experiment import Experiment
from ident.gap.lack_of_fit.repeatability import repeated_rows
from ident.gap.regression.current_model import CurrentFit, extend
from ident.gap.regression.residuals import residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.settings import GapSettings, Transients
from ident.gap.transients.detect import Transient, find_transient
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Excluded:
    """Data and model without some transients.

    Attributes:
        rows: the rows, those inside transients marked as excluded.
        current: the model, fitted without them.
        transients: in order of time.
    """

    rows: WindowedRows
    current: CurrentFit
    transients: tuple[Transient, ...]


def exclude_transients(
    source: Experiment, before: Excluded, larger: CurrentFit, least: float, settings: GapSettings
) -> Excluded:
    """Exclude all transients that stand out beside the next effects.

    Intervals that come back with the motion, that lie where a presliding state is still unknown,
    or that an accepted impact-like effect explains are no transients.

    Args:
        source: the recordings.
        before: data and model so far.
        larger: the model with the effects that are accepted next; the same one if there are none.
        least: gain that a transient needs [nats per sample].
        settings: of the search.
    """
    now, alone = before, larger is before.current
    for _ in range(settings.transients.max_count - len(before.transients)):
        transient = find_transient(now.rows, larger, settings.transients)
        if transient is None or transient.gain < least:
            break
        if _is_no_event(source, now.rows, larger, transient, settings):
            break
        transients = _merged(now.transients, transient, settings.transients.merge_s)
        rows = replace(now.rows, excluded=np.any([b.rows for b in transients], axis=0))
        now = Excluded(rows, extend(rows, now.current, ()), transients)
        larger = now.current if alone else extend(rows, larger, ())
    return now


def _is_no_event(
    source: Experiment,
    rows: WindowedRows,
    current: CurrentFit,
    transient: Transient,
    settings: GapSettings,
) -> bool:
    repeats = repeated_rows(source, rows, settings.repeats)
    return (
        transient.repeats_with_motion(repeats, settings.transients.repeat_share)
        or in_presliding_transient(rows, current, transient, settings.transients)
        or explained_by_accepted(rows, current, transient, settings.transients)
    )


def in_presliding_transient(
    rows: WindowedRows, current: CurrentFit, transient: Transient, settings: Transients
) -> bool:
    """Whether a joint with presliding has hardly moved yet, so that its state is unknown.

    At the start of a segment the bristle may be anywhere between its ends.
    """
    distances = {
        h.joints[0]: distance
        for h in current.accepted
        if (distance := catalogue()[h.effect].memory_distance(h))
        and h.joints[0] in transient.joints
    }
    for s in rows.segments:
        inside = (s.t >= transient.start_s) & (s.t <= transient.end_s)
        if s.log != transient.log or not inside.any():
            continue
        end = int(np.flatnonzero(inside)[-1])
        path = np.abs(np.diff(s.q[: end + 1], axis=0)).sum(axis=0)
        if any(path[j] < settings.settled_bristles * d for j, d in distances.items()):
            return True
    return False


def explained_by_accepted(
    rows: WindowedRows, current: CurrentFit, transient: Transient, settings: Transients
) -> bool:
    """Whether an accepted impact-like effect explains the transient.

    A link that hits the end of its play leaves a residual of nearly the form of the impact. A link
    that oscillates on its spring leaves one that changes its sign; a push has a direction.
    """
    design = current.design(rows)
    left, inside = residuals(design, current.fit), transient.rows
    for i, (h, values) in enumerate(zip(current.accepted, current.fit.effects, strict=True)):
        joint = h.joints[0]
        impact_like = catalogue()[h.effect].form_uncertainty is FormUncertainty.ANY
        if not impact_like or joint not in transient.joints:
            continue
        torque = design.effect_columns(i, joint) @ values
        here, usual = _mean_square(torque[inside]), _mean_square(torque[~inside])
        if all(_oscillates(left[j].values[inside], settings.push_share) for j in transient.joints):
            return True
        residual = _mean_square(left[joint].values[inside])
        if here > max(settings.impact_ratio * usual, settings.min_impact_share * residual):
            return True
    return False


def _oscillates(values: Array, push_share: float) -> bool:
    return float(values.mean()) ** 2 < push_share * _mean_square(values)


def _mean_square(values: Array) -> float:
    return float(np.mean(values**2))


def _merged(
    transients: tuple[Transient, ...], transient: Transient, merge_s: float
) -> tuple[Transient, ...]:
    """The transients with one more, merged with one that is close to it, in order of time."""
    for i, b in enumerate(transients):
        gap = max(transient.start_s - b.end_s, b.start_s - transient.end_s)
        if b.log == transient.log and gap < merge_s:
            start, end = min(b.start_s, transient.start_s), max(b.end_s, transient.end_s)
            rows, at_start = b.rows | transient.rows, b.at_start or transient.at_start
            whole = replace(b, start_s=start, end_s=end, rows=rows, at_start=at_start)
            return (*transients[:i], whole, *transients[i + 1 :])
    return tuple(sorted([*transients, transient], key=lambda b: (b.log, b.start_s)))


def still_stand_out(now: Excluded, least: float, settings: Transients) -> bool:
    """Whether excluded transients still stand out from the model with all effects.

    Very many transients, or very long ones, are no events.
    """
    excluded = now.rows.excluded
    if excluded is None or len(now.transients) >= settings.max_count:
        return False
    if excluded.mean() > settings.max_time_share:
        return False
    transient = find_transient(replace(now.rows, excluded=None), now.current, settings)
    return (
        transient is not None
        and transient.gain >= least
        and bool((transient.rows & excluded).any())
    )
