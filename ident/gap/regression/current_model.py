"""The model so far, and the next effect: fit, score, refine, take in."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate, NonlinearParameter
from ident.effects.catalogue import catalogue
from ident.effects.effect import Effect
from ident.effects.observation import ArmFacts
from ident.effects.observing import CurrentModel, on_links
from ident.effects.reversal_friction import SLOW, USUAL, MaxwellSlipMixture, reversal_speed
from ident.gap.regression.design_matrix import Table, WindowedRows, build_design_matrix
from ident.gap.regression.scoring import EXACT_PER_PLACE, Score, choose_shapes, scan
from ident.gap.regression.weighted_fit import Fit, ModelStructure, fit

Array = NDArray[np.floating]

SEARCHED = (0, 1)
"""Folds on which effects are looked for."""

HELD_OUT = 2
"""The fold that no search has seen."""

_SETTLINGS = 6
_REFINEMENTS = 3
_EXACT_OF_REFINED = 20
_LINEARISATIONS = 3
_PROMISING = 0.8  # of the best form's gain: others are tuned no further
_CLOSER = 2.5  # times closer with each refinement
_FINER = 7  # points of each refinement


@dataclass(frozen=True)
class CurrentFit:
    """The model so far.

    Attributes:
        model: what columns of effects are formed with.
        accepted: effects in the model.
        fit: on the folds that are searched.
    """

    model: CurrentModel
    accepted: tuple[Candidate, ...]
    fit: Fit


def nominal_fit(rows: WindowedRows, facts: ArmFacts) -> CurrentFit:
    """The rigid-body model with viscous and Coulomb friction."""
    none = np.zeros(facts.dof)
    slow = np.full(facts.dof, SLOW[0])
    shapes = np.tile(USUAL, (facts.dof, 1))
    model = CurrentModel(facts, none, none, shapes, slow)
    empty = np.zeros((facts.dof, 1))
    nothing = Fit(ModelStructure(shapes), empty[0], empty, empty.astype(int), empty)
    return _settled(rows, CurrentFit(model, (), nothing))


def extend(rows: WindowedRows, present: CurrentFit, hypotheses: Sequence[Candidate]) -> CurrentFit:
    """The model with more effects, everything fitted again."""
    return _settled(rows, replace(present, accepted=(*present.accepted, *hypotheses)))


def _settled(rows: WindowedRows, present: CurrentFit) -> CurrentFit:
    """Reversal curves, regions, and parameters that agree with each other.

    A wide curve makes the region of turning wide, in which a narrow one may fit as well, which
    makes it narrow again: after the first rounds it only grows.
    """
    for settling in range(_SETTLINGS):
        slow = present.model.slow
        table = build_design_matrix(rows, present.model, present.accepted)
        choice = ModelStructure(present.model.shapes, tuple(table.slots.values()))
        found = choose_shapes(table.grams.of(SEARCHED), choice)
        least = slow if settling > 1 else np.zeros_like(slow)
        model = _updated(rows, present, found, least)
        present = CurrentFit(model, present.accepted, found)
        if settling and (model.slow == slow).all():
            break
    return present


def _updated(rows: WindowedRows, present: CurrentFit, found: Fit, least: Array) -> CurrentModel:
    model = present.model
    b, n = len(rows.kept), model.facts.dof
    delta = model.facts.delta.copy()
    if b:
        delta[:] = 0.0
        delta[rows.kept] = found.x[:b]
    shapes = found.choice.shapes
    return CurrentModel(
        replace(model.facts, delta=delta),
        found.x[b : b + n],
        found.x[b + n : b + 2 * n],
        shapes,
        np.maximum(least, [reversal_speed(MaxwellSlipMixture(s).width) for s in shapes]),
        on_links(present.accepted, found.effects),
    )


def all_hypotheses(facts: ArmFacts) -> list[Candidate]:
    """Everything that the catalogue can look for, in recordings alone or beside a trusted model."""
    effects = [e for e in catalogue().values() if facts.trusted or not e.needs_reference_model]
    return [h for e in effects for h in e.candidates(facts)]


def examine(
    rows: WindowedRows,
    present: CurrentFit,
    hypotheses: Sequence[Candidate],
    exact: int = EXACT_PER_PLACE,
) -> tuple[Table, list[Score]]:
    """Scores of hypotheses beside the model so far, on the folds that are searched."""
    table = build_design_matrix(rows, present.model, present.accepted, hypotheses)
    searched = table.searched(SEARCHED)
    accepted = len(present.accepted)
    choice = ModelStructure(present.model.shapes, tuple(table.slots[i] for i in range(accepted)))
    now = fit(searched.grams, choice, present.fit.sigma)
    return table, scan(searched, now, accepted, exact)


def refine_nonlinear_parameters(
    rows: WindowedRows, present: CurrentFit, score: Score
) -> list[Score]:
    """The same effect at the same place with its settings tuned, one of each form, best first."""
    effect = catalogue()[score.hypothesis.effect]
    if not effect.linear_in_coefficients:
        return [_linearised(rows, present, effect, score)]
    best = {_form(effect, score.hypothesis): score}
    for finer, late in itertools.product(range(_REFINEMENTS), (False, True)):
        near = [n for s in best.values() for n in _neighbours(effect, s.hypothesis, finer, late)]
        if not near:
            continue
        _, found = examine(rows, present, [score.hypothesis, *near], _EXACT_OF_REFINED)
        for s in found:
            form = _form(effect, s.hypothesis)
            if form not in best or s.penalised_gain > best[form].penalised_gain:
                best[form] = s
        most = max(s.penalised_gain for s in best.values())
        best = {form: s for form, s in best.items() if s.penalised_gain > _PROMISING * most}
    return sorted(best.values(), key=lambda s: -s.penalised_gain)


def _linearised(rows: WindowedRows, present: CurrentFit, effect: Effect, score: Score) -> Score:
    """An effect with its columns formed about the coefficients that it comes out with."""
    for _ in range(_LINEARISATIONS):
        _, found = examine(rows, present, [effect.linearised_at(score.hypothesis, score.values)])
        if not found:
            break
        score = found[0]
    return score


def _moved(setting: NonlinearParameter, value: float, finer: int) -> list[float]:
    """Values about one, within the step of the setting's grid."""
    closer, steps = _CLOSER**finer, np.linspace(-1.0, 1.0, _FINER)
    if setting.linear_grid:
        near = value + steps * np.diff(setting.grid).max() / closer
        return np.clip(near, setting.lower, setting.upper).tolist()
    sizes = abs(value) * np.exp(steps * _grid_step(setting.grid, value) / closer)
    return np.copysign(np.clip(sizes, setting.lower, setting.upper), value).tolist()


def _grid_step(grid: Sequence[float], value: float) -> float:
    """Logarithmic step of a grid where a value lies, among the points of its sign."""
    sizes = np.sort([abs(x) for x in grid if x * value > 0.0])
    if len(sizes) < 2:
        sizes = np.sort(np.abs(grid))
    steps = np.diff(np.log(sizes))
    here = int(np.abs(np.log(sizes / abs(value))).argmin())
    return float(steps[max(here - 1, 0) : here + 1].max())


def _form(effect: Effect, hypothesis: Candidate) -> tuple[float, ...]:
    """Settings of which only the grid's own values make sense."""
    names, numbers = [s.name for s in effect.nonlinear if s.discrete], hypothesis.numbers
    return tuple(numbers[n] for n in names if n in numbers)


def _neighbours(effect: Effect, hypothesis: Candidate, finer: int, late: bool) -> list[Candidate]:
    """Hypotheses with the settings moved by less than the step of their grids.

    Settings are moved together, at first over all forms: a speed and an exponent stand in for each
    other. Late ones have their own turn, in which they are moved one at a time.
    """
    value = hypothesis.numbers
    own = [s for s in effect.nonlinear if s.name in value and len(s.grid) > 1]
    if late:
        alone = [(s.name, x) for s in own if _turns(s) for x in _moved(s, value[s.name], 0)]
        return [effect.moved(hypothesis, dict([changed])) for changed in alone]
    moved = [s for s in own if not s.discrete and not s.refine_only]
    forms = [s for s in own if s.discrete and not finer]
    if not moved and not any(s.refine_only for s in forms):
        return []
    choices = [[(s.name, x) for x in _moved(s, value[s.name], finer)] for s in moved]
    choices += [[(s.name, x) for x in s.grid] for s in forms]
    return [effect.moved(hypothesis, dict(changed)) for changed in itertools.product(*choices)]


def _turns(setting: NonlinearParameter) -> bool:
    return setting.refine_only and not setting.discrete
