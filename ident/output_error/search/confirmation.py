"""Whether each part of an arm helps beside all others, on each recording and on all."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit
from ident.output_error.judging import blocks, gain, left_out, sureness
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import BASE
from ident.output_error.search.selection import Accepted, Selection, refitted
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import felt
from ident.output_error.setup import Setup

_SPANS = 3
_LEAST_BLOCKS = 2  # fewer do not tell how they differ


@dataclass(frozen=True)
class Confirmation:
    """How a part helps beside all others.

    Attributes:
        gains: on each recording, or on each third of the only one.
        sureness: standard errors over blocks of time by which it helps there.
        over_all: the same over all blocks.
    """

    gains: tuple[float, ...]
    sureness: tuple[float, ...]
    over_all: float


def confirmed(
    found: Selection, base: Fit, accepted: Sequence[Accepted], begun: Prepared,
    settings: SearchSettings,
) -> tuple[Confirmation, ...]:  # fmt: skip
    """Each of some parts against the arm that was fitted without it.

    Args:
        found: the arm with all parts.
        base: the arm before these were added.
        accepted: the parts in question.
        begun: arm and recordings.
        settings: numbers that decide.
    """
    groups = [_together(a, accepted) for a in accepted]
    without = {
        group: without_parts(found, base, group, begun, settings).errors
        for group in dict.fromkeys(groups)
    }
    spans, made = _spans(found.setup), []
    for a, group in zip(accepted, groups, strict=True):
        here = np.arange(found.errors.shape[1]) == a.joint
        before, after = without[group], found.errors
        before, after = before[:, here], felt(a.part, here, before, after)[:, here]
        parts = [(before[span], after[span]) for span in spans]
        gains = tuple(float(gain(*part)[0]) for part in parts)
        sure = tuple(float(sureness(*part)[0]) for part in parts)
        made.append(Confirmation(gains, sure, float(sureness(before, after)[0])))
    return tuple(made)


def doubt(how: Confirmation, settings: SearchSettings) -> str:
    """Why a part is not sure; empty: it is."""
    if min(how.sureness) < -settings.apart:
        return "some of the motions are predicted better without it"
    if how.over_all < settings.sure:
        return f"it helps by only {how.over_all:.1f} standard errors over all motions"
    return ""


def without_parts(
    found: Selection, base: Fit, parts: Sequence[Accepted], begun: Prepared,
    settings: SearchSettings,
) -> Selection:  # fmt: skip
    """The arm fitted without some of its parts; joints that lose one begin where they were."""
    began, free = found.fit.settings.copy(), found.fit.free.copy()
    for a in parts:
        own = [ROW[name] for name in a.part.quantities]
        free[own, a.joint] = False
        again = own + [ROW[name] for name in BASE]
        began[again, a.joint] = base.settings[again, a.joint]
    made = refitted(found, began, free, parts, begun, settings)
    kept = tuple(a for a in found.accepted if a not in parts)
    return replace(
        found, fit=made, errors=left_out(found.setup, made, begun.prior), accepted=kept, tried=()
    )


def _together(part: Accepted, accepted: Sequence[Accepted]) -> tuple[Accepted, ...]:
    """Parts that can be taken out at once with this one: none is felt at another's joint."""
    alike = (a for a in accepted if a.part == part.part)
    return (part,) if part.part.felt_elsewhere and not part.part.common else tuple(alike)


def _spans(setup: Setup) -> list[NDArray[np.int64]]:
    """Blocks of each recording, or of each third of the only one; all where these are short."""
    names = [s.name for s in setup.segments for _ in blocks(replace(setup, segments=(s,)))[1:]]
    each = [np.flatnonzero(np.array(names) == name) for name in dict.fromkeys(names)]
    spans = each if len(each) > 1 else np.array_split(each[0], _SPANS)
    return [s for s in spans if len(s) >= _LEAST_BLOCKS] or [np.arange(len(names))]
