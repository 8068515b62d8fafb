"""Result of a search: data, models before and after, scores and verdict."""

from dataclasses import dataclass

from ident.gap.data.experiment import Experiment
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.rows import WindowedRows
from ident.gap.results.verdict import Verdict
from ident.gap.selection.scoring import Score
from ident.gap.selection.thresholds import Threshold


@dataclass(frozen=True)
class SearchResult:
    """Result of a search.

    Attributes:
        source: the recordings.
        options: of the search.
        rows: windowed rows, those inside transients marked as excluded.
        start: the nominal model.
        end: the model with all effects.
        first_scores: of all candidates beside the nominal model.
        last_scores: beside the model with all effects.
        threshold: gain that an effect had to reach.
        verdict: the outcome.
    """

    source: Experiment
    options: Options
    rows: WindowedRows
    start: CurrentFit
    end: CurrentFit
    first_scores: tuple[Score, ...]
    last_scores: tuple[Score, ...]
    threshold: Threshold
    verdict: Verdict
