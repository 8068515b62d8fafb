"""The search for the gap, from recordings to a verdict."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.data_checks import faults
from ident.gap.data.experiment import Experiment, base_columns, facts_of
from ident.gap.data.reference_model import known_torque
from ident.gap.data.segments import segments
from ident.gap.data.windows import windows_for
from ident.gap.lack_of_fit.remaining_structure import RemainingStructure, remaining_structures
from ident.gap.regression.current_model import CurrentFit, all_hypotheses, nominal_fit
from ident.gap.regression.design_matrix import WindowedRows, build_design_matrix, windowed_rows
from ident.gap.regression.weighted_fit import mean_squares
from ident.gap.results.outcome import Options, Search
from ident.gap.results.unclosed_gap import noise_of, remaining, unnamed
from ident.gap.results.verdict import UnexplainedStructure, decide, unexplained_structures
from ident.gap.selection.acceptance import Criterion, extend_model, main_joints, next_effects
from ident.gap.selection.backward_elimination import (
    confirm,
    drop_insignificant,
    keep_significant,
    may_be_another,
)
from ident.gap.selection.null_arms import least_threshold
from ident.gap.selection.null_distribution import calibrated
from ident.gap.selection.state import SelectionState
from ident.gap.transients.detect import Transient, at_end_stop, felt
from ident.gap.transients.exclude import exclude_transients, still_significant

Array = NDArray[np.floating]
Tell = Callable[[str], None]


_HIGHEST_SHARE = 0.2  # of the sampling rate
_PLAIN = 0.3  # nats: so much is structure, even if noise drawn from the same residual shows as much


def search(source: Experiment, options: Options, tell: Tell) -> Search:
    """The effects that the nominal model misses in some recordings."""
    tell("checking the data")
    wrong = faults(source)
    rate = source.datasets[0].rate_hz
    windows = windows_for(rate, min(options.cutoff_hz, _HIGHEST_SHARE * rate))
    tell("fitting the nominal model")
    rows = windowed_rows(
        segments(source.datasets, windows),
        windows,
        facts_of(source),
        base_columns(source),
        known_torque(source),
    )
    start = nominal_fit(rows, facts_of(source))
    way = _sequence(source, rows, start, options, tell)
    tell("looking at what is left")
    end = way.present
    rest = _nameless(way)
    if rest and not way.calibrations:
        runs = (options.null_runs, options.seed)
        way.threshold = calibrated(source, way.rows, (end, end), way.threshold, runs, tell)
    if not way.found:
        plain = max(_PLAIN, least_threshold(source.trusted is not None).leftover)
        way.threshold = replace(way.threshold, leftover=min(way.threshold.leftover, plain))
    rest = _nameless(way)
    left = 0.0 if way.transients else remaining(way.noise, start, end, way.found)
    if not way.found and not way.transients:
        rest += unnamed(way.noise, end, rest)
        rest = rest or _doubtful(way)
    transients = felt(way.rows, way.transients, end)
    rest += _placed(way.rows, transients)
    verdict = decide(wrong, way.found, transients, rest, left)
    first, last = tuple(way.scores[0]), tuple(way.scores[-1])
    return Search(source, way.rows, start, end, first, last, way.threshold, verdict)


def _placed(
    rows: WindowedRows, transients: Sequence[Transient]
) -> tuple[UnexplainedStructure, ...]:
    """Contacts that happen wherever a joint comes so far: a stop, for all that is known."""
    gain = max((b.gain for b in transients), default=0.0)
    share = float(1 - np.exp(-2 * gain))
    return tuple(
        UnexplainedStructure(
            RemainingStructure(j, f"the position of joint {j + 1}", gain, share), 1.0
        )
        for j in at_end_stop(rows, transients)
    )


def _doubtful(way: SelectionState) -> tuple[UnexplainedStructure, ...]:
    """What an effect plainly explains on the whole, but not on every part of the data."""
    best = way.scores[-1][0] if way.scores[-1] else None
    if best is None or best.gain < max(_PLAIN, way.threshold.of(best.hypothesis.effect)):
        return ()
    name = "what is not the same in all parts of the recordings"
    share = float(1 - np.exp(-2 * best.gain))
    seat = main_joints(best, way.present.fit)
    return tuple(
        UnexplainedStructure(RemainingStructure(j, name, best.gain, share), 1.0) for j in seat
    )


def _nameless(way: SelectionState) -> tuple[UnexplainedStructure, ...]:
    """Structure that is left and counts."""
    end = way.present
    table = build_design_matrix(way.rows, end.model, end.accepted)
    left = remaining_structures(way.rows, end.model, table, end.fit)
    return unexplained_structures(left, way.found, mean_squares(end.fit), way.threshold)


def _sequence(
    source: Experiment, rows: WindowedRows, start: CurrentFit, options: Options, tell: Tell
) -> SelectionState:
    """Effects taken in one after the other until nothing is left that may be believed."""
    noise = noise_of(source, rows, start)
    way = SelectionState(rows, start, least_threshold(source.trusted is not None), noise)
    _go(source, way, options, tell)
    if way.transients and not still_significant(way):
        way = replace(way, rows=rows, present=start, found=[], transients=[], may_cut=False)
        _go(source, way, options, tell)
    tell("confirming on held-out data")
    confirm(way)
    while drop_insignificant(way):
        _go(source, way, options, tell)
        confirm(way)
    return way


def _go(source: Experiment, way: SelectionState, options: Options, tell: Tell) -> None:
    while not way.full:
        tell(f"scanning the catalogue, round {len(way.scores) + 1}")
        candidates = [
            h
            for h in all_hypotheses(way.present.model.facts)
            if (h.effect, h.joints) not in way.unsure
        ]
        fresh, scores = next_effects(
            way.rows, way.present, candidates, Criterion(way.threshold, way.noise), way.found
        )
        way.scores.append(scores)
        larger = extend_model(way.rows, way.present, fresh) if fresh else way.present
        if exclude_transients(source, way, larger, max((s.gain for s in scores), default=0.0)):
            continue
        if not fresh:
            break
        if way.calibrations <= (1 if way.found else 0):
            way.calibrations += 1
            runs = (options.null_runs, options.seed + 100 * way.calibrations)
            way.threshold = calibrated(
                source, way.rows, (way.present, larger), way.threshold, runs, tell
            )
            fresh = [f for f in fresh if f.score.gain >= way.threshold.of(f.hypothesis.effect)]
        asked = fresh
        fresh, larger = keep_significant(way, fresh, larger)
        if not fresh:
            unsure = {(h.effect, h.joints) for f in asked if may_be_another(h := f.hypothesis)}
            if not unsure:
                break
            way.unsure |= unsure
            continue
        way.present = larger
        way.found += fresh
