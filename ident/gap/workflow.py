"""The search for the gap, from recordings to a verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.effect import Hypothesis
from ident.gap.calibration import calibrated
from ident.gap.contact import Burst, find_burst
from ident.gap.experiment import Experiment, base_columns, facts_of
from ident.gap.faults import faults
from ident.gap.fit import mean_log_ratio, mean_squares, predicted_rms
from ident.gap.leftover import Leftover, leftovers
from ident.gap.naming import Asked, Found, acts_on, next_effects, seat_of, taken_in
from ident.gap.null import Threshold, least_threshold
from ident.gap.repeats import pairs
from ident.gap.scan import Score
from ident.gap.search import HELD_OUT, Present, all_hypotheses, begin, extend
from ident.gap.stretch import stretches
from ident.gap.systematic import noise_of, remaining, unnamed
from ident.gap.table import Nominal, nominal, tabulate
from ident.gap.trusted import known_torque
from ident.gap.uncertainty import clear
from ident.gap.verdict import Nameless, Verdict, decide, nameless
from ident.gap.windows import windows_for

Array = NDArray[np.floating]
Tell = Callable[[str], None]

CUTOFF_HZ = 10.0
"""Cut-off of the windows, where the recordings carry it."""

_HIGHEST_SHARE = 0.2  # of the sampling rate
_MOST_EFFECTS = 6
_PLAIN = 0.3  # nats: so much is structure, even if noise drawn from the same residual shows as much
_BORNE = 0.1  # of an effect's gain: what it must bring on the held-out fold beside all others
_BESIDE = 0.25  # of an effect's gain: what a burst beside it must bring


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
    left = 0.0 if way.burst is not None else remaining(way.noise, start, end, way.found)
    if not way.found and way.burst is None:
        rest += unnamed(way.noise, end, rest)
        rest = rest or _doubtful(way)
    verdict = decide(wrong, way.found, way.burst, rest, left)
    first, last = tuple(way.scores[0]), tuple(way.scores[-1])
    return Search(source, way.rows, start, end, first, last, way.threshold, verdict)


@dataclass
class _Way:
    """How far the search has come."""

    rows: Nominal
    present: Present
    threshold: Threshold
    noise: Array | None
    found: list[Found] = field(default_factory=list)
    burst: Burst | None = None
    may_cut: bool = True
    unsure: set[tuple[str, tuple[int, ...]]] = field(default_factory=set)
    scores: list[list[Score]] = field(default_factory=list)
    calibrations: int = 0

    @property
    def full(self) -> bool:
        """Whether there is enough for one answer."""
        names = {f.hypothesis.effect for f in self.found}
        return len(names) >= _MOST_EFFECTS or len(self.scores) >= 2 * _MOST_EFFECTS


def _doubtful(way: _Way) -> tuple[Nameless, ...]:
    """What an effect plainly explains on the whole, but not on every part of the data."""
    best = way.scores[-1][0] if way.scores[-1] else None
    if best is None or best.gain < max(_PLAIN, way.threshold.of(best.hypothesis.effect)):
        return ()
    name = "what is not the same in all parts of the recordings"
    share = float(1 - np.exp(-2 * best.gain))
    seat = seat_of(best, way.present.fit)
    return tuple(Nameless(Leftover(j, name, best.gain, share), 1.0) for j in seat)


def _nameless(way: _Way) -> tuple[Nameless, ...]:
    """Structure that is left and counts."""
    end = way.present
    table = tabulate(way.rows, end.model, end.accepted)
    left = leftovers(way.rows, end.model, table, end.fit)
    return nameless(left, way.found, mean_squares(end.fit), way.threshold)


def _sequence(
    source: Experiment, rows: Nominal, start: Present, options: Options, tell: Tell
) -> _Way:
    """Effects taken in one after the other until nothing is left that may be believed."""
    noise = noise_of(source, rows, start)
    way = _Way(rows, start, least_threshold(source.trusted is not None), noise)
    _go(source, way, options, tell)
    if way.burst is not None and not _stays(way):
        way = replace(way, rows=rows, present=start, found=[], burst=None, may_cut=False)
        _go(source, way, options, tell)
    tell("confirming on held-out data")
    _confirm(way)
    while _another(way):
        _go(source, way, options, tell)
        _confirm(way)
    return way


def _another(way: _Way) -> bool:
    """Let go of an effect that would be another one without what is no longer sure of it."""
    if not way.found:
        return False
    sure = clear(way.rows, way.present, len(way.found))
    lost = [f for f, c in zip(way.found, sure, strict=True) if not c]
    lost = [f for f in lost if _may_be_another(f.hypothesis)]
    if not lost:
        return False
    way.unsure |= {(f.hypothesis.effect, f.hypothesis.joints) for f in lost}
    way.found = [f for f in way.found if not any(f is x for x in lost)]
    way.present = _with(way, way.found)
    return True


def _confirm(way: _Way) -> None:
    """Let go of effects without which the held-out data are predicted as well."""
    while way.found:
        gains = [_held_gain(way, i) / f.score.gain for i, f in enumerate(way.found)]
        worst = int(np.argmin(gains))
        if gains[worst] > _BORNE:
            return
        way.found = [f for i, f in enumerate(way.found) if i != worst]
        way.present = _with(way, way.found)


def _held_gain(way: _Way, index: int) -> float:
    """By how much one of the effects shrinks the held-out residual of its joints [nats]."""
    effect = way.found[index]
    if "log" in effect.hypothesis.settings:
        return np.inf
    without = _with(way, [f for i, f in enumerate(way.found) if i != index])
    errors = []
    for present in (without, way.present):
        table = tabulate(way.rows, present.model, present.accepted)
        if present is way.present and not acts_on(table, index, present.fit, HELD_OUT):
            return np.inf
        there = table.grams.of([HELD_OUT])
        errors.append(predicted_rms(there, present.fit))
    gains = mean_log_ratio(errors[0], errors[1], there.counts[:, 0])
    return float(gains[list(effect.seat)].sum())


def _with(way: _Way, found: Sequence[Found]) -> Present:
    """The model with just these effects, as they stand."""
    hypotheses = [f.hypothesis for f in found]
    return extend(way.rows, replace(way.present, accepted=()), hypotheses)


def _go(source: Experiment, way: _Way, options: Options, tell: Tell) -> None:
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
        if _cut(source, way, larger, max((s.gain for s in scores), default=0.0)):
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
        fresh, larger = _sure(way, fresh, larger)
        if not fresh:
            unsure = {(h.effect, h.joints) for f in asked if _may_be_another(h := f.hypothesis)}
            if not unsure:
                break
            way.unsure |= unsure
            continue
        way.present = larger
        way.found += fresh


def _may_be_another(h: Hypothesis) -> bool:
    """Whether an effect without a part of it that is not sure is another one."""
    return any(c.essential for c in h.coefficients)


def _sure(way: _Way, fresh: list[Found], larger: Present) -> tuple[list[Found], Present]:
    """Those effects whose size is surely not zero, and the model with them."""
    while fresh:
        if len(larger.accepted) != len(way.present.accepted) + len(fresh):
            larger = taken_in(way.rows, way.present, fresh)
        kept = [f for f, c in zip(fresh, clear(way.rows, larger, len(fresh)), strict=True) if c]
        if len(kept) == len(fresh):
            break
        fresh = kept
    return fresh, larger


def _cut(source: Experiment, way: _Way, larger: Present, best: float) -> bool:
    """Set a burst apart that stands out from the model with the next effects; whether it was done.

    Without such effects it must explain more than any other; with them a good part of theirs: what
    they leave in a few places because their form is another one is no burst. Nor is what comes
    again with the motion.
    """
    if not way.may_cut or way.burst is not None:
        return False
    burst = _loud(way.rows, larger)
    beside = larger is not way.present
    least = max(_BESIDE * best if beside else best, way.threshold.of("contact"))
    if burst is None or burst.gain < least:
        return False
    table = tabulate(way.rows, larger.model, ())
    if burst.recurs(pairs(source, way.rows, table)):
        return False
    way.burst = burst
    way.rows = replace(way.rows, apart=burst.rows)
    way.present = extend(way.rows, way.present, ())
    return True


def _stays(way: _Way) -> bool:
    """Whether the burst still stands out from the model with all effects."""
    if way.burst is None:
        return False
    burst = _loud(replace(way.rows, apart=None), way.present)
    least = way.threshold.of("contact")
    return burst is not None and burst.gain >= least and bool((burst.rows & way.burst.rows).any())


def _loud(rows: Nominal, present: Present) -> Burst | None:
    table = tabulate(rows, present.model, present.accepted)
    return find_burst(rows, table, present.fit, present.fit.choice)
