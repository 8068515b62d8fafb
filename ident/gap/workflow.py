"""The search for the gap, from recordings to a verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.gap.calibration import calibrated
from ident.gap.contact import Burst, find_burst
from ident.gap.experiment import Experiment, base_columns, facts_of
from ident.gap.faults import faults
from ident.gap.fit import Fit
from ident.gap.leftover import leftovers
from ident.gap.naming import Found, next_effects, taken_in
from ident.gap.null import Threshold, least_threshold
from ident.gap.scan import Score
from ident.gap.search import SEARCHED, Present, all_hypotheses, begin
from ident.gap.stretch import stretches
from ident.gap.table import Nominal, nominal, tabulate
from ident.gap.trusted import known_torque
from ident.gap.verdict import Nameless, Verdict, decide, nameless
from ident.gap.windows import windows_for

Array = NDArray[np.floating]
Tell = Callable[[str], None]

CUTOFF_HZ = 10.0
"""Cut-off of the windows, where the recordings carry it."""

_HIGHEST_SHARE = 0.2  # of the sampling rate
_MOST_EFFECTS = 6


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
    rows: Nominal
    start: Present
    end: Present
    first_scores: tuple[Score, ...]
    last_scores: tuple[Score, ...]
    threshold: Threshold
    verdict: Verdict


def search(source: Experiment, options: Options, tell: Tell) -> Search:
    """The effects that the nominal model misses in some recordings."""
    tell("checking the data")
    wrong = faults(source)
    rate = source.datasets[0].rate_hz
    windows = windows_for(rate, min(options.cutoff_hz, _HIGHEST_SHARE * rate))
    tell("fitting the nominal model")
    rows = nominal(
        stretches(source.datasets, windows),
        windows,
        facts_of(source),
        base_columns(source),
        known_torque(source),
    )
    start = begin(rows, facts_of(source))
    found, end, scores, threshold = _sequence(source, rows, start, options, tell)
    burst, left = _rest(rows, end, found, threshold, tell)
    verdict = decide(wrong, found, burst, left)
    return Search(source, rows, start, end, tuple(scores[0]), tuple(scores[-1]), threshold, verdict)


def _sequence(
    source: Experiment, rows: Nominal, start: Present, options: Options, tell: Tell
) -> tuple[list[Found], Present, list[list[Score]], Threshold]:
    """Effects taken in one after the other until nothing is left that may be believed."""
    found: list[Found] = []
    present, threshold = start, least_threshold(source.trusted is not None)
    scores: list[list[Score]] = []
    calibrations = 0
    while (
        len({f.hypothesis.effect for f in found}) < _MOST_EFFECTS
        and len(scores) < 2 * _MOST_EFFECTS
    ):
        tell(f"scanning the catalogue, round {len(scores) + 1}")
        candidates = all_hypotheses(present.model.facts)
        fresh, all_scores = next_effects(rows, present, candidates, threshold, found)
        scores.append(all_scores)
        if fresh and calibrations <= (1 if found else 0):
            calibrations += 1
            runs = (options.null_runs, options.seed + 100 * calibrations)
            threshold = calibrated(source, rows, present, threshold, runs, tell)
            fresh = [f for f in fresh if f.score.gain >= threshold.of(f.hypothesis.effect)]
        if not fresh:
            break
        present = taken_in(rows, present, fresh)
        found += fresh
    return found, present, scores, threshold


def _rest(
    rows: Nominal, end: Present, found: Sequence[Found], threshold: Threshold, tell: Tell
) -> tuple[Burst | None, tuple[Nameless, ...]]:
    """A burst in time, and structure without a name."""
    tell("looking at what is left")
    table = tabulate(rows, end.model, end.accepted)
    burst = find_burst(rows, table, end.fit, end.fit.choice)
    if burst is not None and burst.gain < threshold.of("contact"):
        burst = None
    left = leftovers(rows, end.model, table, end.fit, SEARCHED)
    return burst, nameless(left, found, _squares(end.fit), threshold)


def _squares(model: Fit) -> Array:
    total = (model.sigma**2 * model.counts).sum(axis=1)
    return total / np.maximum(model.counts.sum(axis=1), 1)
