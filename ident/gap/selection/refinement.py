"""Refine the nonlinear parameters of a candidate about the best point of its grid."""

import itertools
from collections.abc import Sequence

import numpy as np

from ident.effects.candidate import Candidate, NonlinearParameter
from ident.effects.catalogue import catalogue
from ident.effects.effect import Effect
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.rows import WindowedRows
from ident.gap.selection.candidates import examine
from ident.gap.selection.scoring import Score
from ident.gap.settings import Scoring

_REFINEMENTS = 3
_LINEARISATIONS = 3
_EXACT = 20  # points of a refinement that are fitted exactly
_CLOSER = 2.5  # times closer with each refinement
_POINTS = 7  # of each refinement


def refine_nonlinear_parameters(
    rows: WindowedRows, current: CurrentFit, score: Score, settings: Scoring
) -> list[Score]:
    """The effect with its nonlinear parameters refined: its best score in each form, best first."""
    effect = catalogue()[score.candidate.effect]
    if not effect.linear_in_coefficients:
        return [_linearised(rows, current, effect, score, settings)]
    best = {_form(effect, score.candidate): score}
    for finer, late in itertools.product(range(_REFINEMENTS), (False, True)):
        near = [n for s in best.values() for n in _neighbours(effect, s.candidate, finer, late)]
        if not near:
            continue
        _, found = examine(rows, current, [score.candidate, *near], settings, _EXACT)
        for s in found:
            form = _form(effect, s.candidate)
            if form not in best or s.penalised_gain > best[form].penalised_gain:
                best[form] = s
        most = max(s.penalised_gain for s in best.values())
        least = most - (1.0 - settings.refined_form_share) * abs(most)
        best = {form: s for form, s in best.items() if s.penalised_gain >= least}
    return sorted(best.values(), key=lambda s: -s.penalised_gain)


def _linearised(
    rows: WindowedRows, current: CurrentFit, effect: Effect, score: Score, settings: Scoring
) -> Score:
    """The effect with its columns formed about its own coefficients."""
    for _ in range(_LINEARISATIONS):
        about = effect.linearised_at(score.candidate, score.values)
        _, found = examine(rows, current, [about], settings)
        if not found:
            break
        score = found[0]
    return score


def _points(parameter: NonlinearParameter, value: float, finer: int) -> list[float]:
    """Values about one, within the step of the parameter's grid."""
    closer, steps = _CLOSER**finer, np.linspace(-1.0, 1.0, _POINTS)
    if parameter.linear_grid:
        near = value + steps * np.diff(parameter.grid).max() / closer
        return np.clip(near, parameter.lower, parameter.upper).tolist()
    sizes = abs(value) * np.exp(steps * _grid_step(parameter.grid, value) / closer)
    return np.copysign(np.clip(sizes, parameter.lower, parameter.upper), value).tolist()


def _grid_step(grid: Sequence[float], value: float) -> float:
    """Logarithmic step of a grid near a value, among the points of its sign."""
    sizes = np.sort([abs(x) for x in grid if x * value > 0.0])
    if len(sizes) < 2:
        sizes = np.sort(np.abs(grid))
    steps = np.diff(np.log(sizes))
    here = int(np.abs(np.log(sizes / abs(value))).argmin())
    return float(steps[max(here - 1, 0) : here + 1].max())


def _form(effect: Effect, candidate: Candidate) -> tuple[float, ...]:
    """The discrete parameters, which tell the forms of an effect apart."""
    names, numbers = [p.name for p in effect.nonlinear if p.discrete], candidate.numbers
    return tuple(numbers[n] for n in names if n in numbers)


def _neighbours(effect: Effect, candidate: Candidate, finer: int, late: bool) -> list[Candidate]:
    """Candidates whose parameters differ by less than the step of their grids.

    Parameters are varied together, at first in all forms, since a speed and an exponent may
    compensate each other. Parameters for refinement only are varied one at a time, in late rounds.
    """
    value = candidate.numbers
    own = [p for p in effect.nonlinear if p.name in value and len(p.grid) > 1]
    if late:
        only = [p for p in own if p.refine_only and not p.discrete]
        alone = [(p.name, x) for p in only for x in _points(p, value[p.name], 0)]
        return [effect.moved(candidate, dict([changed])) for changed in alone]
    varied = [p for p in own if not p.discrete and not p.refine_only]
    forms = [p for p in own if p.discrete and not finer]
    if not varied and not any(p.refine_only for p in forms):
        return []
    choices = [[(p.name, x) for x in _points(p, value[p.name], finer)] for p in varied]
    choices += [[(p.name, x) for x in p.grid] for p in forms]
    return [effect.moved(candidate, dict(changed)) for changed in itertools.product(*choices)]
