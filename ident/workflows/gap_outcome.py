"""A search with its final fits, and the model that is written of it."""

import contextlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.checks.remark import Grade, Remark, no_fit
from ident.effects.catalogue import catalogue
from ident.estimation.regression_data import RegressionData
from ident.gap.data.experiment import Experiment
from ident.gap.naming.across_recordings import spread_over_recordings
from ident.gap.naming.certainty import withheld
from ident.gap.regression.current_model import extend
from ident.gap.regression.feasible_fit import FeasibleModel, feasible_fit
from ident.gap.results.forward_simulation import ForwardSimulation, forward_simulations
from ident.gap.results.full_model import fitted_beside, model_with
from ident.gap.results.held_out_error import BeforeAfter, before_and_after
from ident.gap.results.outcome import SearchResult
from ident.gap.selection.estimates import FinalEstimates, final_estimates
from ident.gap.selection.state import Place, SelectionState
from ident.gap.transients.cut_out import cut_out
from ident.identification.identify import identify, model_of
from ident.identification.term_selection import ON_DEMAND
from ident.identification.validation import arm_of, predict
from ident.model.arm import Arm
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset
from ident.recordings.steady_state import only_steady_state
from ident.signals.arrays import Array
from ident.workflows.model_errors import (
    WORSE,
    errors_on,
    withheld_names,
    worse_reference,
    worse_than_run,
)
from wamctl.arm.errors import DataError

Tell = Callable[[str], None]

_WORSE_WITH_IT = "beside it, and what was found with it, the arm explains these recordings worse"
"""Why nothing is named, in half a sentence."""


@dataclass(frozen=True)
class Outcome:
    """A search with its final estimates and simulations.

    Attributes:
        found: the search.
        final: values of the effects on all data.
        whole: the feasible arm with all effects, on all data.
        both: residuals before and after, of fits on the searched folds.
        before, after: simulations of the recordings.
        remarks: fits that took another way than the usual one.
    """

    found: SearchResult
    final: FinalEstimates
    whole: FeasibleModel
    both: BeforeAfter
    before: list[ForwardSimulation]
    after: list[ForwardSimulation]
    remarks: tuple[Remark, ...]

    @property
    def places(self) -> set[Place]:
        """Effects of the model, with a name or without one."""
        return {(h.effect, h.joints) for h in self.final.effects}


@dataclass(frozen=True)
class Written:
    """The model that is written of a search.

    Attributes:
        model: the arm with its effects.
        evidence: what it was fitted to, without the effects; None where the search's own fit is the
            model.
        failed: what is said where the fit beside the effects failed.
    """

    model: Model
    evidence: RegressionData | None = None
    failed: tuple[Remark, ...] = ()


def outcome_of(found: SearchResult, tell: Tell) -> Outcome:
    """The final fits of a search, and simulations with them."""
    tell("fitting all data")
    final, whole = _final_fits(found)
    b = len(found.rows.base_parameters)
    before, after = (feasible_fit(found.source, p.fit, b) for p in (found.start, found.end))
    tell("simulating the recordings")
    old = forward_simulations(found.source, before, ())
    new = forward_simulations(found.source, whole, final.effects) if found.end.accepted else old
    both = before_and_after(found, before.x, after.x)
    notes = dict.fromkeys(f.note for f in (before, after, whole) if f.note)
    remarks = tuple(no_fit(note, Grade.DOUBTFUL) for note in notes)
    return Outcome(found, final, whole, both, old, new, remarks)


def _final_fits(found: SearchResult) -> tuple[FinalEstimates, FeasibleModel]:
    """Values of the effects on all data, and the feasible arm with them."""
    asked = found.options.settings
    named = found.verdict.effects
    final = final_estimates(found.rows, found.end, asked.significance, named, systematic=True)
    final = spread_over_recordings(found.rows, found.end, final, asked.cross_validation)
    last = final.fit if found.end.accepted else found.end.fit
    return final, feasible_fit(found.source, last, len(found.rows.base_parameters), near_cad=True)


def written_model(outcome: Outcome, tell: Tell) -> tuple[Outcome, Written]:
    """The arm as `ident run` fits it beside the effects.

    The search's own fit is the model then, and so it is beside a reference model, which stays. What
    is in the model without a name has to predict the unfiltered torque no worse: without what does
    not, the final fits are made again.

    Args:
        outcome: of a search.
        tell: is told the progress.

    Returns:
        the outcome of what is in the model, and the model.
    """
    written = _fitted(outcome.found, outcome.final, outcome.whole)
    rough = set() if written.failed else _rough(outcome.found, written.model)
    if not rough:
        return outcome, written
    outcome = outcome_of(_without(outcome.found, rough), tell)
    return outcome, _fitted(outcome.found, outcome.final, outcome.whole)


def _rough(found: SearchResult, model: Model) -> set[Place]:
    """What is in the model without a name, and with which unfiltered torque is predicted worse.

    A torque that rings or jumps may help where it is filtered, and spoil what it is added to.
    """
    inside = {s.effect.place for s in found.verdict.suspected if s.in_model}
    asked = {place for place in inside if not catalogue()[place[0]].usual_term}
    if not asked or found.source.reference_model is not None:
        return set()
    data = counted(found.source)
    whole = _unfiltered_errors(model, data)
    rough = set()
    for place in asked:
        less = _without(found, {place})
        other = _fitted(less, *_final_fits(less))
        if not other.failed and np.nanmean(_unfiltered_errors(other.model, data) - whole) < 0.0:
            rough.add(place)
    return rough


def _unfiltered_errors(model: Model, data: Sequence[Dataset]) -> Array:
    """Relative error of unfiltered torque on each recording [%], shape (L,).

    NaN for one that is too short to say what the model's effects do in it.
    """
    arm, errors = arm_of(model), np.full(len(data), np.nan)
    for k, recording in enumerate(data):
        with contextlib.suppress(DataError):
            errors[k] = predict(model, arm, recording).raw[model.estimator].relative_percent
    return errors


def _without(found: SearchResult, places: Collection[Place]) -> SearchResult:
    """The search without effects that were in the model without a name."""
    accepted = [h for h in found.end.accepted if (h.effect, h.joints) not in places]
    end = extend(found.rows, replace(found.end, accepted=()), accepted)
    suspected = tuple(
        replace(s, in_model=False) if s.effect.place in places else s
        for s in found.verdict.suspected
    )
    return replace(found, end=end, verdict=replace(found.verdict, suspected=suspected))


def beside_run(
    outcome: Outcome, written: Written, tell: Tell
) -> tuple[Outcome, Written, tuple[Remark, ...]]:
    """Without names, where beside them the arm explains less than `ident run`'s without effects.

    Less of the recordings, and of parts that it was not fitted to: without effects, parameters may
    fit a short motion better, and predict another one worse.

    Args:
        outcome: of a search.
        written: the model of it.
        tell: is told the progress.

    Returns:
        the outcome and the model that count, and what is said of it.
    """
    found, model = outcome.found, written.model
    run = _model_of_run(found) if model.effects.records else None
    fitted = found.source.reference_model is None
    if run is None or (fitted and _unexplained(model) <= WORSE * _unexplained(run)):
        return outcome, written, ()
    data = counted(found.source)
    worse = worse_than_run(errors_on(model, data), run, data)
    if worse is None:
        return outcome, written, ()
    if not fitted:
        return outcome, written, (worse_reference(worse),)
    outcome, written = written_model(outcome_of(_without_names(found), tell), tell)
    return outcome, written, (withheld_names(worse),)


def _unexplained(model: Model) -> float:
    """What a model leaves of its recordings, or of held-out parts, at joints that move [N m]."""
    return float(np.sqrt(np.nansum(np.square(model.noise))))


def _without_names(found: SearchResult) -> SearchResult:
    """The search with all that it found suspected only, and in the model only on request."""
    asked, before = found.options.settings, found.verdict
    effects = (*before.effects, *(s.effect for s in before.suspected if s.in_model))
    state = SelectionState(found.rows, found.end, found.threshold, None, effects)
    inside = found.options.with_suspected
    rest, apart = withheld(found.source, state, asked, inside, _WORSE_WITH_IT)
    others = (s for s in before.suspected if not s.in_model)
    verdict = replace(before.without_names(), effects=(), suspected=(*apart, *others))
    return replace(found, end=rest.current, verdict=verdict)


def _fitted(found: SearchResult, final: FinalEstimates, whole: FeasibleModel) -> Written:
    """The model of a search."""
    source = found.source
    model = model_with(source, whole, final.fit, final.effects)
    if source.reference_model is not None:
        return Written(model)
    arm = _as_run(found)
    named = {e.place for e in found.verdict.effects}
    pushes = found.verdict.transients
    data = [cut_out(d, log, pushes) for log, d in enumerate(counted(source))]
    try:
        return Written(*fitted_beside(model, named, data, arm))
    except (DataError, np.linalg.LinAlgError) as error:
        failed = no_fit(f"The fit beside the effects failed: {error}", Grade.DOUBTFUL)
        return Written(model, failed=(failed,))


def _as_run(found: SearchResult) -> Arm:
    """The arm with the terms that `ident run` fits to it."""
    arm = found.source.arm
    plain = tuple(t for t in arm.settings.terms if t != ON_DEMAND)
    more = (ON_DEMAND,) if found.options.terms_on_demand else ()
    return arm.with_settings(terms=(*plain, *more))


def _model_of_run(found: SearchResult) -> Model | None:
    """The model of `ident run` on the same recordings, without effects; None where it has none."""
    try:
        return model_of(identify(counted(found.source), _as_run(found)))
    except (DataError, np.linalg.LinAlgError):
        return None


def counted(source: Experiment) -> list[Dataset]:
    """The recordings of a search as `ident run` and `ident validate` count them.

    In their steady state, and whole: where the search does not go across a step that readings lost,
    the parts may be too short for a filter, and little would be left of them.
    """
    pairs = zip(source.datasets, source.recordings, strict=True)
    return [only_steady_state(replace(d, breaks=()), found, d.name) for d, found in pairs]
