"""The verdict: which effects are sure, and whether something is left that none explains."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.output_error.fit import Fit
from ident.output_error.identify import fit_of_all
from ident.output_error.judging import explained, sureness, typical
from ident.output_error.missing.forms import middle_form
from ident.output_error.missing.search import Search
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared
from ident.output_error.search.confirmation import Confirmation, confirmed, doubt, without_parts
from ident.output_error.search.fewest import fewest
from ident.output_error.search.selection import Accepted, clearly_off
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial
from ident.output_error.uncertainty import Knowledge, knowledge
from ident.regression.progress import Tell
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Evidence:
    """What speaks for an effect.

    Attributes:
        beside: how it helps beside all others.
        deviations: standard deviations of its size from nothing.
    """

    beside: Confirmation
    deviations: float


@dataclass(frozen=True)
class Suspected:
    """An effect that helps and is not sure enough to be named.

    Attributes:
        effect, evidence: as of a named one.
        doubt: why it is not named.
        settings: of the arm with it, shape (quantities, n).
        sd: their standard deviations, in the same units; NaN where not known.
    """

    effect: Accepted
    evidence: Evidence
    doubt: str
    settings: Array
    sd: Array


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
        search: what was found.
        effects: named ones.
        evidence: for each named one.
        suspected: the others.
        left: what no effect explains.
        before, after: fits of all recordings, without and with the named effects.
        known: how well the latter is known.
    """

    kind: str
    search: Search
    effects: tuple[Accepted, ...]
    evidence: tuple[Evidence, ...]
    suspected: tuple[Suspected, ...]
    left: tuple[Left, ...]
    before: Fit
    after: Fit
    known: Knowledge


def outcome(begun: Prepared, found: Search, settings: SearchSettings, tell: Tell) -> Outcome:
    """What the search may say.

    Args:
        begun: arm and recordings.
        found: the search.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    tell("confirming each effect beside the others")
    fewer = fewest(found.end, found.base.fit, found.effects, begun, settings)
    found = replace(found, end=fewer)
    after, known, evidence = _known(begun, found, settings, tell)
    pairs = [(a, e, _doubt(e, settings)) for a, e in zip(found.effects, evidence, strict=True)]
    suspected = tuple(Suspected(*each, after.settings, known.sd) for each in pairs if each[2])
    if suspected:
        base, doubted = found.base.fit, [s.effect for s in suspected]
        found = replace(found, end=without_parts(found.end, base, doubted, begun, settings))
        after, known, evidence = _known(begun, found, settings, tell)
    left = _left(found, begun, settings)
    suspected = suspected or nearly_sure(found, [x.joint for x in left], settings)
    before = fit_of_all(begun, found.base.fit, tell) if found.effects else after
    kind = _kind(found.effects, left)
    return Outcome(kind, found, found.effects, evidence, suspected, left, before, after, known)


def _known(
    begun: Prepared, found: Search, settings: SearchSettings, tell: Tell
) -> tuple[Fit, Knowledge, tuple[Evidence, ...]]:
    """The fit of all recordings, how well it is known, and what speaks for each effect."""
    beside = confirmed(found.end, found.base.fit, found.effects, begun, settings)
    places = [(a.part, a.joint) for a in found.effects]
    after = fit_of_all(begun, found.end.fit, tell)
    after, spread = middle_form(begun.setup, begun.prior, after, places, settings, tell)
    known = knowledge(begun.setup, after, begun.prior)
    known = replace(known, sd=np.hypot(known.sd, spread))
    rows = [ROW[a.part.quantities[0]] for a in found.effects]
    sizes = [
        float(known.deviations[row, a.joint]) for row, a in zip(rows, found.effects, strict=True)
    ]
    return after, known, tuple(Evidence(*each) for each in zip(beside, sizes, strict=True))


def _kind(effects: tuple[Accepted, ...], left: tuple[Left, ...]) -> str:
    if left:
        return "unknown"
    if any(e.rivals for e in effects):
        return "ambiguous"
    return "named" if effects else "no_gap"


def _doubt(evidence: Evidence, settings: SearchSettings) -> str:
    if evidence.deviations < settings.sure_size:
        return f"its size is only {evidence.deviations:.1f} standard deviations from nothing"
    return doubt(evidence.beside, settings)


def nearly_sure(
    found: Search, joints: Sequence[int], settings: SearchSettings
) -> tuple[Suspected, ...]:
    """What explains most of what is left at some joints, if it helps at all surely."""
    errors, made = found.end.errors, []
    for joint in joints:
        helping = [
            t
            for t in found.end.tried
            if t.part in found.asked
            and t.places[joint]
            and not t.is_nothing(joint)
            and t.gain[joint] >= found.least(t.part, settings)
            and sureness(errors, t.errors)[joint] >= settings.apart
        ]
        if helping:
            best = max(helping, key=lambda t: float(t.gain[joint]))
            made.append(_unsure(best, joint, found, settings))
    return tuple(made)


def _unsure(trial: Trial, joint: int, found: Search, settings: SearchSettings) -> Suspected:
    sure, size = (float(of(found.end.errors, trial.errors)[joint]) for of in (sureness, explained))
    own, least = float(trial.gain[joint]), found.least(trial.part, settings)
    return Suspected(
        Accepted(trial.part, joint, own, least, size, None, ()),
        Evidence(Confirmation((own,), (sure,), sure), np.nan),
        f"it helps by {sure:.1f} standard errors over stretches of time only",
        trial.fit.settings,
        np.full_like(trial.fit.settings, np.nan),
    )


def _left(found: Search, begun: Prepared, settings: SearchSettings) -> tuple[Left, ...]:
    """Joints at which error is left that no effect explains."""
    floor = found.nulls.typical
    before, after = typical(found.base.errors), typical(found.end.errors)
    gap, rest = (typical_error**2 - floor**2 for typical_error in (before, after))
    share = np.clip(rest / np.maximum(gap, rest.clip(1e-300)), 0.0, 1.0)
    off = clearly_off(found.end.errors, floor, begun.resolution, settings)
    clear = off & begun.moving & (share > settings.unclosed)
    return tuple(
        Left(int(j), float(after[j]), float(floor[j]), float(share[j]))
        for j in np.flatnonzero(clear)
    )
