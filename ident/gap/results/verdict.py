"""The verdict: no gap, named, ambiguous, unknown, or a data fault."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from ident.gap.data.broken_time import Fault
from ident.gap.naming.certainty import Suspected
from ident.gap.results.unexplained import UnexplainedStructure
from ident.gap.selection.state import AcceptedEffect
from ident.gap.settings import GapSettings
from ident.gap.transients.detect import Transient


class Kind(StrEnum):
    """The verdict in one word."""

    NO_GAP = "no_gap"
    NAMED = "named"
    AMBIGUOUS = "ambiguous"
    UNKNOWN = "unknown"
    DATA_FAULT = "data_fault"


@dataclass(frozen=True)
class Verdict:
    """Outcome of a search.

    Attributes:
        kind: in one word.
        effects: named ones, in order of acceptance.
        transients: in order of time.
        unexplained: structure that no effect explains.
        faults: of the data.
        suspected: effects that help prediction and are not sure enough to be named.
        unsure_transients: intervals whose torque is not sure enough to be one.
    """

    kind: Kind
    effects: tuple[AcceptedEffect, ...]
    transients: tuple[Transient, ...]
    unexplained: tuple[UnexplainedStructure, ...]
    faults: tuple[Fault, ...]
    suspected: tuple[Suspected, ...] = ()
    unsure_transients: tuple[Transient, ...] = ()

    def without_names(self) -> "Verdict":
        """The same with events that are only suspected; a gap is `unknown` then."""
        unsure = (*self.unsure_transients, *self.transients)
        kind = Kind.UNKNOWN if self.kind in (Kind.NAMED, Kind.AMBIGUOUS) else self.kind
        return replace(self, kind=kind, transients=(), unsure_transients=unsure)


def decide(
    faults: Sequence[Fault],
    effects: Sequence[AcceptedEffect],
    transients: Sequence[Transient],
    unexplained: Sequence[UnexplainedStructure],
    settings: GapSettings,
    unclosed: float = 0.0,
    suspected: Sequence[Suspected] = (),
) -> Verdict:
    """The verdict.

    Args:
        faults: of the data.
        effects: accepted ones.
        transients: in order of time.
        unexplained: structure that no effect explains.
        settings: of the search.
        unclosed: share of the gap at the effects' joints that they do not close.
        suspected: effects that are not sure enough to be named.
    """
    z = settings.naming.z
    sure = tuple(b for t in transients if (b := t.at_sure_joints(z)) is not None)
    unsure = tuple(t for t in transients if t.at_sure_joints(z) is None)
    parts = (tuple(effects), sure, tuple(unexplained), tuple(faults), tuple(suspected), unsure)
    clear = settings.lack_of_fit.clear_gain
    gains = [*(s.effect.score.gain for s in suspected), *(b.gain for b in unsure)]
    doubtful = any(gain > clear for gain in gains)
    incomplete = unclosed > settings.verdict.max_unclosed
    if faults:
        return Verdict(Kind.DATA_FAULT, *parts)
    if incomplete or doubtful or any(x.share_of_gap > _allowed(x, settings) for x in unexplained):
        return Verdict(Kind.UNKNOWN, *parts)
    if any(e.rivals for e in effects):
        return Verdict(Kind.AMBIGUOUS, *parts)
    if effects or sure:
        return Verdict(Kind.NAMED, *parts)
    return Verdict(Kind.NO_GAP, *parts)


def _allowed(left: UnexplainedStructure, settings: GapSettings) -> float:
    """Share of a joint's gap that may be structure of that kind beside the accepted effects.

    Clear structure on the data of the fit means that the effect's form is another one. If only the
    held-out data show it, the motion there may differ.
    """
    clear = left.structure.gain > settings.lack_of_fit.clear_gain
    if clear and not left.structure.held_out_only:
        return settings.verdict.max_unexplained_clear
    return settings.verdict.max_unexplained
