"""Final estimates of the effects' parameters, with standard errors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.effects.candidate import Candidate, Value
from ident.effects.catalogue import catalogue
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import Fit, mean_log_ratio
from ident.gap.selection.gauss_newton import Linearised, linearised, refit, solution, stepped
from ident.gap.selection.scoring import Score
from ident.gap.selection.state import AcceptedEffect
from ident.gap.settings import Significance
from ident.signals.arrays import Array

_RECTANGLE = 3**-0.5  # standard deviation of what lies anywhere within one (JCGM 100:2008, 4.3.7)
_FORM_ROUNDS = 3  # the other form hangs on the values: a spring hardens about where it rests
_STEPS = (1.0, 0.5, 0.25)  # parts of a Gauss-Newton step


@dataclass(frozen=True)
class FinalEstimates:
    """The model with all effects on all data.

    Attributes:
        effects: after the Gauss-Newton step.
        fit: with them.
        parameters: of each effect, by name.
    """

    effects: tuple[Candidate, ...]
    fit: Fit
    parameters: tuple[dict[str, Value], ...]


def final_estimates(
    rows: WindowedRows,
    end: CurrentFit,
    settings: Significance,
    accepted: Sequence[AcceptedEffect] = (),
    systematic: bool = False,
) -> FinalEstimates:
    """Final values and standard errors of all effects.

    Args:
        rows: the rows.
        end: the model with all effects.
        settings: of the standard errors.
        accepted: the same effects with their other forms, in the same order: where the data cannot
            tell the forms apart, standard errors span them.
        systematic: whether standard errors hold what the model gets wrong alike in each period and
            near reversals, as those that are reported do; the tests of the search have bounds of
            their own.
    """
    effects, at = _gauss_newton_step(rows, end, settings)
    if systematic:
        effects, at = _with_needed_terms(rows, end, (effects, at), settings)
    named = _named(effects, at, solution(rows, at, settings.block_s, systematic)[1])
    for i, (h, values, item) in enumerate(zip(effects, named, accepted, strict=False)):
        forms = (*item.forms, *item.near_forms) if systematic else item.forms
        parts = _form_errors(h, item.score, forms, end.model.slow)
        parts |= _alternative_errors(rows, end, at, effects, i)
        for name, part in _double_number_errors(rows, end, at, effects, i, settings).items():
            parts[name] = float(np.hypot(parts.get(name, 0.0), part))
        for name, part in parts.items():
            if name in values and values[name].sd > 0.0:
                of_form = part * values[name].value * _RECTANGLE
                sd = float(np.hypot(values[name].sd, of_form))
                values[name] = replace(values[name], sd=sd)
    return FinalEstimates(effects, at.fit, tuple(named))


def _gauss_newton_step(
    rows: WindowedRows, end: CurrentFit, settings: Significance
) -> tuple[tuple[Candidate, ...], Linearised]:
    """The effects after one step, halved until the data are explained no worse, and the fit there.

    The whole step may lead to where the linearised columns do not hold: below a limit that a
    torque passes all the time, say.
    """
    effects = end.accepted
    free = [free_parameters(h) for h in effects]
    at = linearised(rows, end, effects, free)
    if not any(free):
        return effects, at
    step = solution(rows, at, settings.block_s)[0][len(at.fit.x) :]
    for part in _STEPS:
        moved = stepped(effects, free, part * step)
        there = linearised(rows, end, moved, free)
        if there.fit.gain_over(at.fit) >= 0.0:
            return moved, there
    return effects, at


def _with_needed_terms(
    rows: WindowedRows,
    end: CurrentFit,
    now: tuple[tuple[Candidate, ...], Linearised],
    settings: Significance,
) -> tuple[tuple[Candidate, ...], Linearised]:
    """The effects with those further terms of their other forms that are surely not zero.

    A spring that hardens has another stiffness at rest than one that does not: once the data tell
    that it does, that is no uncertainty but an error.
    """
    effects, at = now
    for i, h in enumerate(effects):
        for _ in range(_FORM_ROUNDS):
            form = catalogue()[h.effect].alternative_form(effects[i], at.fit.effects[i])
            if form is None or len(form.coefficients) == len(h.coefficients):
                break
            others = tuple(form if k == i else other for k, other in enumerate(effects))
            there = linearised(rows, end, others, [free_parameters(o) for o in others])
            sd = np.sqrt(solution(rows, there, settings.block_s, systematic=True)[1])
            widths = [len(o.coefficients) for o in others]
            last = len(there.fit.x) - sum(widths[i + 1 :])
            further = slice(last - len(form.coefficients) + len(h.coefficients), last)
            if not (np.abs(there.fit.x[further]) > settings.z * sd[further]).any():
                break
            effects, at = others, there
    return effects, at


def estimates_with_fixed_parameters(
    rows: WindowedRows, end: CurrentFit, settings: Significance
) -> list[dict[str, Value]]:
    """The effects' coefficients, with their nonlinear parameters held."""
    at = linearised(rows, end, end.accepted, [() for _ in end.accepted])
    return _named(end.accepted, at, solution(rows, at, settings.block_s)[1])


def _form_errors(
    h: Candidate, score: Score, forms: Sequence[Score], slow: Array
) -> dict[str, float]:
    """How far each value may be off because the effect's form is uncertain, relative to it."""
    first = {name: x for name, x in _sizes(score).items() if x}
    parts = {
        name: max((abs(_sizes(form)[name] / x - 1) for form in forms), default=0.0)
        for name, x in first.items()
    }
    effect = catalogue()[h.effect]
    unseen = effect.unobserved_fraction(h, float(slow[h.joints[0]]))
    if unseen > 0.0:
        parts |= {c.name: float(np.hypot(parts[c.name], unseen)) for c in h.coefficients}
    return parts


def _alternative_errors(
    rows: WindowedRows, end: CurrentFit, at: Linearised, effects: Sequence[Candidate], index: int
) -> dict[str, float]:
    """Relative change of an effect's coefficients in an alternative form of it."""
    h, values = effects[index], at.fit.effects[index]
    form = catalogue()[h.effect].alternative_form(h, values)
    if form is None:
        return {}
    others = [form if i == index else other for i, other in enumerate(effects)]
    again = refit(rows, end, at.fit, others).effects[index]
    return {
        c.name: abs(float(new / old - 1))
        for c, old, new in zip(h.coefficients, values, again, strict=False)
        if old
    }


def _double_number_errors(
    rows: WindowedRows,
    end: CurrentFit,
    at: Linearised,
    effects: Sequence[Candidate],
    index: int,
    settings: Significance,
) -> dict[str, float]:
    """Relative error of a coefficient that stands in its effect's columns as well.

    Where the effect explains the data with both made one, the coefficient's change is the error:
    slow motion shows how far a transmission gives, not how fast it swings. Else the two differ
    because the effect is another one, and the error is their difference in parts of the larger one.
    """
    h, values = effects[index], at.fit.effects[index]
    effect = catalogue()[h.effect]
    if effect.same_number is None:
        return {}
    coefficient, parameter = effect.same_number
    place = [c.name for c in h.coefficients].index(coefficient)
    value = float(values[place])
    if value == 0.0:
        return {}
    other = h.numbers[parameter]
    apart = abs(other - value) / max(abs(other), abs(value))
    one = effect.moved(h, {parameter: abs(value)})
    again = refit(rows, end, at.fit, [*effects[:index], one, *effects[index + 1 :]])
    less = refit(rows, end, at.fit, [*effects[:index], *effects[index + 1 :]])
    explained, kept = (
        mean_log_ratio(less.sigma, model.sigma, less.counts) for model in (at.fit, again)
    )
    joint = int(np.argmax(explained))
    if kept[joint] < settings.min_consistent_share * explained[joint]:
        return {coefficient: apart}
    return {coefficient: abs(float(again.effects[index][place]) / value - 1.0)}


def _sizes(score: Score) -> dict[str, float]:
    """Coefficients and parameters of a score, by name."""
    names = [c.name for c in score.candidate.coefficients]
    return dict(zip(names, map(float, score.values), strict=True)) | score.candidate.numbers


def free_parameters(h: Candidate) -> tuple[str, ...]:
    """Nonlinear parameters that are estimated from the data, not chosen from a list."""
    return tuple(
        p.name
        for p in catalogue()[h.effect].nonlinear
        if p.name in h.numbers and p.is_parameter and not p.discrete
    )


def _named(
    effects: Sequence[Candidate], at: Linearised, variances: Array
) -> list[dict[str, Value]]:
    """Values with standard errors, by name, as each effect reports them."""
    sd = np.sqrt(variances)
    first = len(at.fit.x) - sum(len(h.coefficients) for h in effects)
    last = len(at.fit.x)
    found = []
    for h, names, theta in zip(effects, at.parameters, at.fit.effects, strict=True):
        effect = catalogue()[h.effect]
        values = {}
        for c, value in zip(h.coefficients, theta, strict=True):
            if value != 0.0 or sd[first] > 0.0:  # else a column that this form does not have
                values[c.name] = Value(float(value), float(sd[first]), c.unit)
            first += 1
        known = {p.name: p for p in effect.nonlinear}
        for name in names:
            values[name] = Value(h.numbers[name], float(sd[last]), known[name].unit)
            last += 1
        for p in effect.nonlinear:
            if p.discrete and p.is_parameter and p.name in h.numbers:
                values[p.name] = Value(h.numbers[p.name], 0.0, p.unit)  # chosen, not estimated
        found.append(effect.as_reported(h, values))
    return found
