"""The verdict: what may be said, and how surely."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ident.gap.data.data_checks import Fault
from ident.gap.lack_of_fit.remaining_structure import RemainingStructure
from ident.gap.selection.acceptance import AcceptedEffect
from ident.gap.selection.null_arms import Threshold
from ident.gap.transients.detect import Transient

_UNEXPLAINED = 0.2  # of a joint's gap: with more left, a name is only an analogy
_REMAINING = 0.12  # of the gap at the joints of the effects: with more left, they are not all of it
_ANALOGY = 0.3  # nats: so much structure where it was fitted says that its form is another one,
_NEARLY = 0.03  # unless no more than this part of the joint's gap is left with it


class Kind(StrEnum):
    """What may be said."""

    NO_GAP = "no_gap"
    NAMED = "named"
    AMBIGUOUS = "ambiguous"
    UNKNOWN = "unknown"
    DATA_FAULT = "data_fault"


@dataclass(frozen=True)
class UnexplainedStructure:
    """Structure that is left on a joint when the catalogue is exhausted.

    Attributes:
        leftover: what it depends on, and how much it is.
        unexplained: its part of the joint's whole gap.
    """

    leftover: RemainingStructure
    unexplained: float


@dataclass(frozen=True)
class Verdict:
    """What the search came to.

    Attributes:
        kind: in one word.
        found: effects taken in, in order.
        transients: contacts, in order of time.
        nameless: structure that is left.
        faults: of the data.
    """

    kind: Kind
    found: tuple[AcceptedEffect, ...]
    transients: tuple[Transient, ...]
    unexplained_structures: tuple[UnexplainedStructure, ...]
    faults: tuple[Fault, ...]


def unexplained_structures(
    remaining_structures: Sequence[RemainingStructure],
    found: Sequence[AcceptedEffect],
    squares: np.ndarray,
    threshold: Threshold,
) -> tuple[UnexplainedStructure, ...]:
    """The structure that is left and counts, one entry a joint, the largest first.

    Args:
        remaining_structures: by gain, the largest first.
        found: effects taken in.
        squares: mean squared residual of each joint with them [N^2 m^2], shape (n,).
        threshold: what structure must gain.
    """
    seen: set[int] = set()
    kept = []
    for left in remaining_structures:
        if left.joint in seen or left.gain < threshold.leftover:
            continue
        seen.add(left.joint)
        explained = sum(float(f.explained[left.joint]) for f in found)
        rest = left.share * float(squares[left.joint])
        share = rest / max(rest + explained, 1e-300)
        kept.append(UnexplainedStructure(left, share))
    return tuple(kept)


def _allowed(gain: float) -> float:
    """Part of a joint's gap that structure of that gain may be beside an effect."""
    return _NEARLY if gain > _ANALOGY else _UNEXPLAINED


def decide(
    faults: Sequence[Fault],
    found: Sequence[AcceptedEffect],
    transients: Sequence[Transient],
    left: Sequence[UnexplainedStructure],
    remaining: float = 0.0,
) -> Verdict:
    """The verdict on what was found and what is left.

    Args:
        faults: of the data.
        found: effects taken in.
        transients: contacts, in order of time.
        left: structure without a name.
        remaining: part of the gap at the effects' joints that they do not close.
    """
    parts = (tuple(found), tuple(transients), tuple(left), tuple(faults))
    if faults:
        return Verdict(Kind.DATA_FAULT, *parts)
    if remaining > _REMAINING or any(
        x.unexplained > (_UNEXPLAINED if x.leftover.ahead else _allowed(x.leftover.gain))
        for x in left
    ):
        return Verdict(Kind.UNKNOWN, *parts)
    if any(f.rivals for f in found):
        return Verdict(Kind.AMBIGUOUS, *parts)
    if found or transients:
        return Verdict(Kind.NAMED, *parts)
    return Verdict(Kind.NO_GAP, *parts)
