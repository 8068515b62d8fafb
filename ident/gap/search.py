"""The search for missing effects, from recordings to a verdict: all stages in order.

Nominal model, then forward selection with thresholds from effect-free data, then backward
elimination, a test for lack of fit, and the question which effects are sure. Each stage takes a
state and returns the next one.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from ident.effects.candidate import Candidate
from ident.effects.events import CONTACT
from ident.gap.data.blocks import blocks_of
from ident.gap.data.broken_time import data_faults
from ident.gap.data.experiment import Experiment, base_columns, facts_of
from ident.gap.data.reference_model import reference_torque
from ident.gap.data.windows import windows_for
from ident.gap.lack_of_fit.repeatability import first_pass, sliding_noise
from ident.gap.naming.certainty import (
    IMPOSSIBLE_ARM,
    Suspected,
    not_among,
    set_apart,
    sure_in_the_end,
    withheld,
)
from ident.gap.naming.terms_on_demand import terms_on_demand
from ident.gap.nulls.null_distribution import calibrated
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, nominal_fit
from ident.gap.regression.rows import WindowedRows, windowed_rows
from ident.gap.results.outcome import SearchResult
from ident.gap.results.unexplained import (
    UnexplainedStructure,
    end_stops,
    excess_over_pure_error,
    inconsistent_effect,
    unclosed_fraction,
    unexplained_structures,
)
from ident.gap.results.verdict import decide
from ident.gap.selection.acceptance import next_effects
from ident.gap.selection.backward_elimination import (
    drop_insignificant,
    drop_unconfirmed,
    keep_significant,
)
from ident.gap.selection.candidates import all_candidates, examine
from ident.gap.selection.masked_pairs import masked_pair
from ident.gap.selection.rivals import told_apart
from ident.gap.selection.significance import has_defining_coefficient, significant
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import least_threshold
from ident.gap.settings import GapSettings
from ident.gap.transients.detect import find_transient, with_affected_joints
from ident.gap.transients.exclude import Excluded, exclude_transients, still_stand_out

Tell = Callable[[str], None]


def search(source: Experiment, options: Options, tell: Tell) -> SearchResult:
    """Find the effects that the nominal model misses in some recordings.

    Args:
        source: the recordings and their arm.
        options: of the search.
        tell: is told the progress.
    """
    settings = options.settings
    tell("checking the data")
    faults = data_faults(source.datasets)
    tell("fitting the nominal model")
    rows = rows_of(source, options)
    nominal = nominal_fit(rows, facts_of(source))
    noise = sliding_noise(source, rows, nominal, settings.repeats, settings.lack_of_fit)
    least = least_threshold(settings.thresholds, source.reference_model is not None)
    state = SelectionState(rows, nominal, least, noise)
    state = _select_forward(source, state, options, tell)
    if state.transients and not _transients_stand_out(state, options):
        bare = replace(state, rows=rows, current=nominal, accepted=(), transients=())
        state = _select_forward(source, replace(bare, may_exclude=False), options, tell)
    tell("confirming on held-out data")
    state = drop_unconfirmed(state, settings)
    while (fewer := drop_insignificant(state, settings.significance)) is not state:
        state = drop_unconfirmed(_select_forward(source, fewer, options, tell), settings)
    tell("testing for lack of fit")
    state, unexplained = _lack_of_fit(source, state, options, tell)
    rows, end = state.rows, state.current
    transients = with_affected_joints(rows, state.transients, end, settings.transients)
    unexplained += end_stops(rows, transients, settings.transients)
    unclosed = 0.0
    if not transients:
        unclosed = unclosed_fraction(noise, nominal, end, state.accepted, settings.repeats)
    first, last = state.scores[0], state.scores[-1]
    tell("asking which effects are sure")
    if source.is_possible:
        state, suspected = set_apart(source, state, settings)
        state, suspected = _in_model_or_not(source, state, suspected, options)
        if suspected or state.accepted:
            state, suspected = sure_in_the_end(source, state, suspected, settings)
    else:
        inside = options.with_suspected
        state, suspected = withheld(source, state, settings, inside, IMPOSSIBLE_ARM)
    end = state.current
    named = told_apart(not_among(suspected, state.accepted))
    verdict = decide(faults, named, transients, unexplained, settings, unclosed, suspected)
    verdict = verdict if source.is_possible else verdict.without_names()
    return SearchResult(source, options, rows, nominal, end, first, last, state.threshold, verdict)


def _in_model_or_not(
    source: Experiment, state: SelectionState, suspected: Sequence[Suspected], options: Options
) -> tuple[SelectionState, tuple[Suspected, ...]]:
    """The model's effects, and what is suspected, with the terms on demand beside them.

    A term that is sure beside what is named is named after all.
    """
    if options.with_suspected:
        return state, tuple(replace(s, in_model=True) for s in suspected)
    if not options.terms_on_demand:
        return state, tuple(suspected)
    terms = terms_on_demand(source, state, suspected, options.settings)
    sure = [t for t in terms if not t.doubt]
    if sure:
        state = state.with_only([*state.accepted, *(t.effect for t in sure)])
    asked_again = {t.effect.place for t in terms}
    others = [s for s in suspected if s.effect.place not in asked_again]
    return state, (*(t for t in terms if t.doubt), *others)


def rows_of(source: Experiment, options: Options) -> WindowedRows:
    """Windowed torque and nominal columns of all recordings.

    A reference model's error is known below the cut-off of its fit only: above it, what the model
    always lacked would pass for a change.
    """
    rate, model = source.datasets[0].rate_hz, source.reference_model
    highest = options.settings.scoring.max_cutoff_share * rate
    if model is not None:
        highest = min(highest, model.filter.cutoff_hz)
    windows = windows_for(rate, min(options.cutoff_hz, highest))
    blocks = blocks_of(source.datasets, windows)
    rows = windowed_rows(blocks, facts_of(source), base_columns(source), reference_torque(source))
    return replace(rows, first_pass=first_pass(source, rows, options.settings.repeats))


def _select_forward(
    source: Experiment, state: SelectionState, options: Options, tell: Tell
) -> SelectionState:
    """Forward selection, until neither a candidate passes every test nor two hide each other."""
    again = True
    while again and not state.is_full(options.settings.scoring.max_effects):
        tell(f"scanning the catalogue, round {len(state.scores) + 1}")
        state, again = _round(source, state, options, tell)
        if not again:
            state, again = _pair_round(source, state, options, tell)
    return state


def _free(state: SelectionState) -> list[Candidate]:
    """All candidates that have not turned out insignificant at their places."""
    every = all_candidates(state.current.model.facts)
    return [h for h in every if (h.effect, h.joints) not in state.dropped]


def _pair_round(
    source: Experiment, state: SelectionState, options: Options, tell: Tell
) -> tuple[SelectionState, bool]:
    """Accept two effects that hide each other; the next state, and whether to go on."""
    settings = options.settings
    pair = masked_pair(state, _free(state), settings)
    if not pair:
        return state, False
    larger, before = state.with_more(pair), state
    state = _calibrated_if_due(source, state, larger, options, tell)
    if state is not before and not all(map(state.reached_by, pair)):
        return state, True
    if not all(significant(state.rows, larger, len(pair), settings.significance)):
        return state, False
    return replace(state, current=larger, accepted=(*state.accepted, *pair)), True


def _round(
    source: Experiment, state: SelectionState, options: Options, tell: Tell
) -> tuple[SelectionState, bool]:
    """Score, accept, exclude transients, calibrate; the next state, and whether to go on."""
    settings = options.settings
    fresh, scores = next_effects(state, _free(state), settings)
    state = replace(state, scores=(*state.scores, scores))
    larger = state.with_more(fresh) if fresh else state.current
    without = _exclude_transients(source, state, larger, options)
    if without is not state:
        return without, True
    if not fresh:
        return state, False
    before = state
    state = _calibrated_if_due(source, state, larger, options, tell)
    if state is not before:
        fresh = [a for a in fresh if state.reached_by(a)]
        if not fresh:
            return state, True  # others may reach the new thresholds
    kept, larger = keep_significant(state, fresh, larger, settings.significance)
    if kept:
        accepted = (*state.accepted, *kept)
        return replace(state, current=larger, accepted=accepted), True
    dropped = [a.place for a in fresh if has_defining_coefficient(a.candidate)]
    return state.with_dropped(dropped), bool(dropped)


def _exclude_transients(
    source: Experiment, state: SelectionState, larger: CurrentFit, options: Options
) -> SelectionState:
    """The state without transients that stand out beside the next effects.

    A transient must explain more than any candidate that is left, and a good share of what the next
    effects explain.
    """
    if not state.may_exclude:
        return state
    settings = options.settings
    best = max((s.gain for s in state.scores[-1]), default=0.0)
    if larger is not state.current:
        share = settings.transients.share_beside_effect
        best = max(share * best, _best_left(state, larger, settings))
    least = max(best, state.threshold.of(CONTACT.id))
    before = Excluded(state.rows, state.current, state.transients)
    now = exclude_transients(source, before, larger, least, settings)
    if now is before:
        return state
    return replace(state, rows=now.rows, current=now.current, transients=now.transients)


def _best_left(state: SelectionState, larger: CurrentFit, settings: GapSettings) -> float:
    """Largest gain of any candidate beside a larger model; zero where no transient asks for it."""
    transient = find_transient(state.rows, larger, settings.transients)
    if transient is None or transient.gain < state.threshold.of(CONTACT.id):
        return 0.0
    _, scores = examine(state.rows, larger, _free(state), settings.scoring)
    return max((s.gain for s in scores), default=0.0)


def _transients_stand_out(state: SelectionState, options: Options) -> bool:
    now = Excluded(state.rows, state.current, state.transients)
    least = state.threshold.of(CONTACT.id)
    return still_stand_out(now, least, options.settings.transients)


def _calibrated_if_due(
    source: Experiment, state: SelectionState, larger: CurrentFit, options: Options, tell: Tell
) -> SelectionState:
    """With new thresholds before the first effect is taken, and before the next ones."""
    if state.calibrations > (1 if state.accepted else 0):
        return state
    state = replace(state, calibrations=state.calibrations + 1)
    return _calibrated(source, state, larger, options, tell)


def _calibrated(
    source: Experiment, state: SelectionState, larger: CurrentFit, options: Options, tell: Tell
) -> SelectionState:
    return replace(state, threshold=calibrated(source, state, larger, options, tell))


def _lack_of_fit(
    source: Experiment, state: SelectionState, options: Options, tell: Tell
) -> tuple[SelectionState, tuple[UnexplainedStructure, ...]]:
    """Structure that no effect explains, with a threshold from effect-free data."""
    settings = options.settings
    found = unexplained_structures(state, settings)
    if found and not state.calibrations:
        state = _calibrated(source, state, state.current, options, tell)
    if not state.accepted:
        least = least_threshold(settings.thresholds, source.reference_model is not None)
        clear = max(settings.lack_of_fit.clear_gain, least.structure)
        lower = min(state.threshold.structure, clear)
        state = replace(state, threshold=replace(state.threshold, structure=lower))
    found = unexplained_structures(state, settings)
    if not state.transients:
        noted = excess_over_pure_error(state.noise, state.current, found, settings.repeats)
        named = {j for a in state.accepted for j in a.joints}
        found += tuple(x for x in noted if x.structure.joint not in named)
    if not state.accepted and not state.transients:
        found = found or inconsistent_effect(state, settings)
    return state, found
