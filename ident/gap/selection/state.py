"""How far a search has come: what it took in, set apart, and asked."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.regression.current_model import CurrentFit, extend
from ident.gap.regression.design_matrix import WindowedRows
from ident.gap.regression.scoring import Score
from ident.gap.selection.acceptance import AcceptedEffect
from ident.gap.selection.null_arms import Threshold
from ident.gap.transients.detect import Transient

Array = NDArray[np.floating]

_MOST_EFFECTS = 6


@dataclass
class SelectionState:
    """How far the search has come.

    Attributes:
        rows: the recordings' rows, but for those of transients.
        present: the model with what was taken in.
        threshold: what an effect has to gain.
        noise: of the repeats, shape (n,), where motion is repeated.
        found: effects taken in.
        transients: contacts that were set apart, in order of time.
        may_cut: whether any may be.
        unsure: effects and joints that were let go, and are not asked for again.
        scores: of all hypotheses, round by round.
        calibrations: how often the threshold was calibrated.
    """

    rows: WindowedRows
    present: CurrentFit
    threshold: Threshold
    noise: Array | None
    found: list[AcceptedEffect] = field(default_factory=list)
    transients: list[Transient] = field(default_factory=list)
    may_cut: bool = True
    unsure: set[tuple[str, tuple[int, ...]]] = field(default_factory=set)
    scores: list[list[Score]] = field(default_factory=list)
    calibrations: int = 0

    @property
    def full(self) -> bool:
        """Whether there is enough for one answer."""
        names = {f.hypothesis.effect for f in self.found}
        return len(names) >= _MOST_EFFECTS or len(self.scores) >= 2 * _MOST_EFFECTS


def with_only(way: SelectionState, found: Sequence[AcceptedEffect]) -> CurrentFit:
    """The model with just these effects, as they stand."""
    hypotheses = [f.hypothesis for f in found]
    return extend(way.rows, replace(way.present, accepted=()), hypotheses)
