"""The search for the gap, from recordings to a verdict."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.data_checks import faults
from ident.gap.data.experiment import Experiment, base_columns, facts_of
from ident.gap.data.reference_model import known_torque
from ident.gap.data.segments import stretches
from ident.gap.data.windows import windows_for
from ident.gap.lack_of_fit.remaining_structure import Leftover, leftovers
from ident.gap.regression.current_model import Present, all_hypotheses, begin
from ident.gap.regression.design_matrix import Nominal, nominal, tabulate
from ident.gap.regression.weighted_fit import mean_squares
from ident.gap.results.outcome import Options, Search
from ident.gap.results.unclosed_gap import noise_of, remaining, unnamed
from ident.gap.results.verdict import Nameless, decide, nameless
from ident.gap.selection.acceptance import Asked, next_effects, seat_of, taken_in
from ident.gap.selection.backward_elimination import confirm, let_go, may_be_another, only_sure
from ident.gap.selection.null_arms import least_threshold
from ident.gap.selection.null_distribution import calibrated
from ident.gap.selection.state import Way
from ident.gap.transients.detect import Burst, at_an_end, felt
from ident.gap.transients.exclude import cut_out, stays

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
    rows = nominal(
        stretches(source.datasets, windows),
        windows,
        facts_of(source),
        base_columns(source),
        known_torque(source),
    )
    start = begin(rows, facts_of(source))
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
    left = 0.0 if way.bursts else remaining(way.noise, start, end, way.found)
    if not way.found and not way.bursts:
        rest += unnamed(way.noise, end, rest)
        rest = rest or _doubtful(way)
    bursts = felt(way.rows, way.bursts, end)
    rest += _placed(way.rows, bursts)
    verdict = decide(wrong, way.found, bursts, rest, left)
    first, last = tuple(way.scores[0]), tuple(way.scores[-1])
    return Search(source, way.rows, start, end, first, last, way.threshold, verdict)


def _placed(rows: Nominal, bursts: Sequence[Burst]) -> tuple[Nameless, ...]:
    """Contacts that happen wherever a joint comes so far: a stop, for all that is known."""
    gain = max((b.gain for b in bursts), default=0.0)
    share = float(1 - np.exp(-2 * gain))
    return tuple(
        Nameless(Leftover(j, f"the position of joint {j + 1}", gain, share), 1.0)
        for j in at_an_end(rows, bursts)
    )


def _doubtful(way: Way) -> tuple[Nameless, ...]:
    """What an effect plainly explains on the whole, but not on every part of the data."""
    best = way.scores[-1][0] if way.scores[-1] else None
    if best is None or best.gain < max(_PLAIN, way.threshold.of(best.hypothesis.effect)):
        return ()
    name = "what is not the same in all parts of the recordings"
    share = float(1 - np.exp(-2 * best.gain))
    seat = seat_of(best, way.present.fit)
    return tuple(Nameless(Leftover(j, name, best.gain, share), 1.0) for j in seat)


def _nameless(way: Way) -> tuple[Nameless, ...]:
    """Structure that is left and counts."""
    end = way.present
    table = tabulate(way.rows, end.model, end.accepted)
    left = leftovers(way.rows, end.model, table, end.fit)
    return nameless(left, way.found, mean_squares(end.fit), way.threshold)


def _sequence(
    source: Experiment, rows: Nominal, start: Present, options: Options, tell: Tell
) -> Way:
    """Effects taken in one after the other until nothing is left that may be believed."""
    noise = noise_of(source, rows, start)
    way = Way(rows, start, least_threshold(source.trusted is not None), noise)
    _go(source, way, options, tell)
    if way.bursts and not stays(way):
        way = replace(way, rows=rows, present=start, found=[], bursts=[], may_cut=False)
        _go(source, way, options, tell)
    tell("confirming on held-out data")
    confirm(way)
    while let_go(way):
        _go(source, way, options, tell)
        confirm(way)
    return way


def _go(source: Experiment, way: Way, options: Options, tell: Tell) -> None:
    while not way.full:
        tell(f"scanning the catalogue, round {len(way.scores) + 1}")
        candidates = [
            h
            for h in all_hypotheses(way.present.model.facts)
            if (h.effect, h.joints) not in way.unsure
        ]
        fresh, scores = next_effects(
            way.rows, way.present, candidates, Asked(way.threshold, way.noise), way.found
        )
        way.scores.append(scores)
        larger = taken_in(way.rows, way.present, fresh) if fresh else way.present
        if cut_out(source, way, larger, max((s.gain for s in scores), default=0.0)):
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
        fresh, larger = only_sure(way, fresh, larger)
        if not fresh:
            unsure = {(h.effect, h.joints) for f in asked if may_be_another(h := f.hypothesis)}
            if not unsure:
                break
            way.unsure |= unsure
            continue
        way.present = larger
        way.found += fresh
