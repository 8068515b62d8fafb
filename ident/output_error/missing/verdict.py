"""The verdict: which effects are sure, and whether something is left that none explains."""

from dataclasses import dataclass, replace

import numpy as np

from ident.output_error.fit import Fit
from ident.output_error.identify import Prepared, fit_of_all
from ident.output_error.missing.judging import typical
from ident.output_error.missing.search import (
    Accepted,
    Confirmation,
    Search,
    confirmed,
    lacking,
    share_left,
    unexplained,
)
from ident.output_error.missing.settings import GapBySimulation
from ident.output_error.parameters import ROW
from ident.output_error.uncertainty import Knowledge, knowledge
from ident.regression.progress import Tell


@dataclass(frozen=True)
class Evidence:
    """What speaks for an effect beside all others.

    Attributes:
        gains: on each fold, predicted by a fit to the others [nats per sample].
        sureness: standard errors over the blocks of all folds by which it helps.
        deviations: standard deviations of its size from nothing.
    """

    gains: tuple[float, ...]
    sureness: float
    deviations: float


@dataclass(frozen=True)
class Suspected:
    """An effect that helps and is not sure enough to be named: why not."""

    effect: Accepted
    evidence: Evidence
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
        evidence: for each named one.
        suspected: the others.
        left: what no effect explains.
        before, after: fits of all recordings, without and with the named effects.
        known: how well the latter is known.
    """

    kind: str
    search: Search
    confirmation: Confirmation
    effects: tuple[Accepted, ...]
    evidence: tuple[Evidence, ...]
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
    evidence = _evidence(found, checked, after, known)
    doubts = [_doubt(e, settings) for e in evidence]
    pairs = list(zip(found.accepted, evidence, doubts, strict=True))
    suspected = tuple(Suspected(a, e, why) for a, e, why in pairs if why)
    if suspected:
        kept = lacking(found, [s.effect for s in suspected])
        found = replace(found, end=kept, accepted=tuple(a for a, _, why in pairs if not why))
        checked = confirmed(found, begun, settings)
        after = fit_of_all(begun, found.end, tell)
        known = knowledge(begun.setup, after, begun.prior)
        evidence = _evidence(found, checked, after, known)
    left = _left(checked, found, begun, settings)
    before = fit_of_all(begun, found.base, tell) if found.accepted else after
    kind = _kind(found.accepted, left)
    return Outcome(
        kind, found, checked, found.accepted, evidence, suspected, left, before, after,
        known,
    )  # fmt: skip


def _kind(effects: tuple[Accepted, ...], left: tuple[Left, ...]) -> str:
    if left:
        return "unknown"
    if any(e.rivals for e in effects):
        return "ambiguous"
    return "named" if effects else "no_gap"


def _evidence(
    found: Search, checked: Confirmation, after: Fit, known: Knowledge
) -> tuple[Evidence, ...]:
    rows = [ROW[a.kind.part.quantities[0]] for a in found.accepted]
    sizes = [
        float(abs(after.settings[row, a.joint]) / known.sd[row, a.joint])
        for row, a in zip(rows, found.accepted, strict=True)
    ]
    parts = zip(checked.gains, checked.sureness, sizes, strict=True)
    return tuple(Evidence(*each) for each in parts)


def _doubt(evidence: Evidence, settings: GapBySimulation) -> str:
    if evidence.deviations < settings.sure:
        return f"its size is only {evidence.deviations:.1f} standard deviations from nothing"
    if min(evidence.gains) <= 0.0:
        return "some of the motions that were left out are predicted better without it"
    if evidence.sureness < settings.sure:
        return f"it helps by only {evidence.sureness:.1f} standard errors over all motions"
    return ""


def _left(
    checked: Confirmation, found: Search, begun: Prepared, settings: GapBySimulation
) -> tuple[Left, ...]:
    before, after = (np.concatenate(errors) for errors in (checked.before, checked.after))
    floor = found.nulls.typical
    rms, share = typical(after), share_left(before, after, floor)
    clear = unexplained(before, after, floor, begun, settings)
    return tuple(
        Left(int(j), float(rms[j]), float(floor[j]), float(share[j])) for j in np.flatnonzero(clear)
    )
