"""How a search is done, and what it went through."""

from dataclasses import dataclass

from ident.gap.data.experiment import Experiment
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import WindowedRows
from ident.gap.regression.scoring import Score
from ident.gap.results.verdict import Verdict
from ident.gap.selection.null_arms import Threshold

CUTOFF_HZ = 10.0
"""Cut-off of the windows, where the recordings carry it."""


@dataclass(frozen=True)
class Options:
    """How the search is done.

    Attributes:
        null_runs: effect-free runs that are simulated.
        cutoff_hz: of the windows.
        seed: of all that is drawn.
    """

    null_runs: int = 4
    cutoff_hz: float = CUTOFF_HZ
    seed: int = 0


@dataclass(frozen=True)
class Search:
    """What the search went through.

    Attributes:
        source: the recordings.
        rows: their rows.
        start: the nominal model.
        end: the model with all effects.
        first_scores: of all hypotheses beside the nominal model.
        last_scores: beside the model with all effects.
        threshold: what an effect had to gain.
        verdict: what it came to.
    """

    source: Experiment
    rows: WindowedRows
    start: CurrentFit
    end: CurrentFit
    first_scores: tuple[Score, ...]
    last_scores: tuple[Score, ...]
    threshold: Threshold
    verdict: Verdict
