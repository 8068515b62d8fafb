"""All candidates of the catalogue, and their scores beside the current model."""

from collections.abc import Sequence

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts
from ident.gap.data.blocks import SEARCHED
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import fit
from ident.gap.selection.scoring import EXACT_PER_PLACE, Score, score_candidates
from ident.gap.settings import Scoring


def all_candidates(facts: ArmFacts) -> list[Candidate]:
    """Every effect at every place that recordings alone, or a reference model, can show."""
    effects = [e for e in catalogue().values() if facts.trusted or not e.needs_reference_model]
    return [h for e in effects for h in e.candidates(facts)]


def special_cases(candidate: Candidate) -> list[Candidate]:
    """The effects that a candidate contains, at each of its joints."""
    contained = catalogue()[candidate.effect].contains
    return [catalogue()[name].at((j,)) for name in contained for j in candidate.joints]


def examine(
    rows: WindowedRows,
    current: CurrentFit,
    candidates: Sequence[Candidate],
    settings: Scoring,
    exact: int = EXACT_PER_PLACE,
) -> tuple[DesignMatrix, list[Score]]:
    """Scores of candidates beside the current model on the searched folds, best first."""
    design = current.design(rows, candidates)
    searched = design.of(SEARCHED)
    structure = design.structure(current.model.shapes)
    now = fit(searched.equations, structure, current.fit.sigma)
    return design, score_candidates(searched, now, settings, exact)
