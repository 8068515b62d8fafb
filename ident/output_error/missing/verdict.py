"""The verdict: which effects are sure, and whether something is left that none explains."""

from dataclasses import dataclass, replace

import numpy as np

from ident.output_error.fit import Fit
from ident.output_error.identify import Prepared, fit_of_all
from ident.output_error.missing.judging import typical
from ident.output_error.missing.search import Accepted, Confirmation, Search, confirmed, lacking
from ident.output_error.missing.settings import GapBySimulation
from ident.output_error.parameters import ROW
from ident.output_error.uncertainty import Knowledge, knowledge
from ident.regression.progress import Tell


@dataclass(frozen=True)
class Suspected:
    """An effect that helps and is not sure enough to be named: why not."""

    effect: Accepted
    deviations: float
    doubt: str


@dataclass(frozen=True)
class Left:
    """What no effect explains.

    Attributes:
        joint: from 0.
        rms: held-out, with all effects, of the typical block of time [rad].
        floor: the same of a model that misses nothing [rad].
        share: of the joint's gap.
    """

    joint: int
    rms: float
    floor: float
    share: float


@dataclass(frozen=True)
class Outcome:
    """A search with its verdict.

    Attributes:
        kind: of the verdict, in one word.
        search: what was found on the first fold.
        confirmation: errors on all folds.
        effects: named ones.
        gains: of each named one, on each fold.
        deviations: standard deviations of each named one's size from nothing.
        suspected: the others.
        left: what no effect explains.
        before, after: fits of all recordings, without and with the named effects.
        known: how well the latter is known.
    """

    kind: str
    search: Search
    confirmation: Confirmation
    effects: tuple[Accepted, ...]
    gains: tuple[tuple[float, ...], ...]
    deviations: tuple[float, ...]
    suspected: tuple[Suspected, ...]
    left: tuple[Left, ...]
    before: Fit
    after: Fit
    known: Knowledge


def outcome(begun: Prepared, found: Search, settings: GapBySimulation, tell: Tell) -> Outcome:
    """What the search may say.

    Args:
        begun: arm and recordings.
        found: the search.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    tell("confirming on motions that were left out")
    checked = confirmed(found, begun, settings)
    after = fit_of_all(begun, found.end, tell)
    known = knowledge(begun.setup, after, begun.prior)
    sizes = [_deviations(a, after, known) for a in found.accepted]
    doubts = [_doubt(g, d, settings) for g, d in zip(checked.gains, sizes, strict=True)]
    pairs = list(zip(found.accepted, sizes, doubts, strict=True))
    suspected = tuple(Suspected(a, d, why) for a, d, why in pairs if why)
    if suspected:
        kept = lacking(found, [s.effect for s in suspected])
        found = replace(found, end=kept, accepted=tuple(a for a, _, why in pairs if not why))
        checked = confirmed(found, begun, settings)
        after = fit_of_all(begun, found.end, tell)
        known = knowledge(begun.setup, after, begun.prior)
    left = _left(checked, found, begun, settings)
    before = fit_of_all(begun, found.base, tell) if found.accepted else after
    sizes = tuple(_deviations(a, after, known) for a in found.accepted)
    kind = _kind(found.accepted, left)
    return Outcome(
        kind, found, checked, found.accepted, checked.gains, sizes, suspected, left, before, after,
        known,
    )  # fmt: skip


def _kind(effects: tuple[Accepted, ...], left: tuple[Left, ...]) -> str:
    if left:
        return "unknown"
    if any(e.rivals for e in effects):
        return "ambiguous"
    return "named" if effects else "no_gap"


def _deviations(effect: Accepted, after: Fit, known: Knowledge) -> float:
    row = ROW[effect.kind.part.quantities[0]]
    return float(abs(after.settings[row, effect.joint]) / known.sd[row, effect.joint])


def _doubt(gains: tuple[float, ...], deviations: float, settings: GapBySimulation) -> str:
    if deviations < settings.sure:
        return f"its size is only {deviations:.1f} standard deviations from nothing"
    if min(gains) <= 0.0:
        return "some of the motions that were left out are predicted better without it"
    return ""


def _left(
    checked: Confirmation, found: Search, begun: Prepared, settings: GapBySimulation
) -> tuple[Left, ...]:
    held = [np.concatenate(errors) for errors in (checked.before, checked.after)]
    (before, after), floor = (typical(errors) for errors in held), found.nulls.typical
    gap, rest = before**2 - floor**2, after**2 - floor**2
    share = np.clip(rest / np.maximum(gap, rest.clip(1e-300)), 0.0, 1.0)
    seen = np.sqrt(rest.clip(0.0)) > settings.clear_steps * begun.resolution
    clear = (after > settings.clear * floor) & seen & (share > settings.unclosed) & begun.moving
    return tuple(
        Left(int(j), float(after[j]), float(floor[j]), float(share[j]))
        for j in np.flatnonzero(clear)
    )
