"""Final values of the effects' parameters, and how sure they are.

Coefficients and settings are estimated together: one Gauss-Newton step from the search's solution,
on all data. Their covariance is the cluster-robust one, scores summed over blocks of time and all
joints, since residuals of neighbouring rows are alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate, Value
from ident.effects.catalogue import catalogue
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import (
    EXCLUDED,
    FOLDS,
    Table,
    WindowedRows,
    build_design_matrix,
)
from ident.gap.regression.scoring import Score
from ident.gap.regression.weighted_fit import Fit, fit, places, solve
from ident.gap.selection.acceptance import AcceptedEffect

Array = NDArray[np.floating]

_BLOCK_S = 1.5
_SURE = 2.5  # standard deviations
_SURE_AS_IT_STANDS = 8.0  # the same with the settings held
_TINY = np.finfo(float).tiny
_STEP = 0.02  # of a setting: for its derivative
_MOST = 0.3  # of a setting: the longest step that is taken


@dataclass(frozen=True)
class FinalEstimates:
    """The model with all effects on all data.

    Attributes:
        hypotheses: with their settings stepped.
        fit: with them.
        parameters: of each effect, by name.
    """

    hypotheses: tuple[Candidate, ...]
    fit: Fit
    parameters: tuple[dict[str, Value], ...]


def clear(rows: WindowedRows, model: CurrentFit, count: int) -> list[bool]:
    """Whether each of the last so many effects has a coefficient that is surely not zero.

    Where an effect would be another one without a coefficient, it must be that one. A coefficient
    that only its settings make unsure (a drift's size, whose end the recording does not reach) is
    sure if it is so with the settings as they are.
    """
    told = [_sureness(model.accepted, final_estimates(rows, model).parameters)[-count:]]
    if min(told[0]) <= _SURE:
        told.append(_sureness(model.accepted, _as_it_stands(rows, model))[-count:])
    plain = told[-1]
    return [
        x > _SURE or (len(told) > 1 and y > _SURE_AS_IT_STANDS)
        for x, y in zip(told[0], plain, strict=True)
    ]


def _sureness(
    hypotheses: Sequence[Candidate], parameters: Sequence[dict[str, Value]]
) -> list[float]:
    """Largest ratio of a telling coefficient to its standard deviation, of each effect."""
    found = []
    for h, values in zip(hypotheses, parameters, strict=True):
        telling = [c.name for c in h.coefficients if c.defining]
        names = telling or [c.name for c in h.coefficients]
        sizes = [values[n] for n in names if n in values]
        found.append(max((abs(v.value) / max(v.sd, _TINY) for v in sizes), default=0.0))
    return found


def _as_it_stands(rows: WindowedRows, end: CurrentFit) -> list[dict[str, Value]]:
    """The effects' coefficients with their settings held."""
    held: list[list[str]] = [[] for _ in end.accepted]
    table, now, slopes = _linearised(rows, end, end.accepted, held)
    _, covariance = _solution(rows, table, now, slopes)
    return _named(end.accepted, held, now, np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def final_estimates(
    rows: WindowedRows, end: CurrentFit, found: Sequence[AcceptedEffect] = ()
) -> FinalEstimates:
    """Final values and standard deviations of all effects.

    Args:
        rows: the recordings.
        end: the model with all effects.
        found: what is known of them, in the same order: where the data cannot tell an effect's
            forms from each other, its values are as uncertain as they differ among them.
    """
    tunable = [_tunable(h) for h in end.accepted]
    stepped = end.accepted
    if any(tunable):
        table, now, slopes = _linearised(rows, end, end.accepted, tunable)
        x, _ = _solution(rows, table, now, slopes)
        stepped = _gauss_newton_step(end.accepted, tunable, x[len(now.x) :])
    table, now, slopes = _linearised(rows, end, stepped, tunable)
    x, covariance = _solution(rows, table, now, slopes)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    named = _named(stepped, tunable, now, sd)
    for i, (h, values, item) in enumerate(zip(stepped, named, found, strict=False)):
        parts = _form_errors(h, item, end.model.slow) | _bend_errors(rows, end, now, stepped, i)
        for name, part in parts.items():
            if name in values and values[name].sd > 0.0:
                sd = float(np.hypot(values[name].sd, part * values[name].value))
                values[name] = replace(values[name], sd=sd)
    return FinalEstimates(stepped, now, tuple(named))


def _form_errors(h: Candidate, item: AcceptedEffect, slow: Array) -> dict[str, float]:
    """Relative standard deviation of each value that comes from not knowing the effect's form."""
    first = {name: x for name, x in _sizes(item.score).items() if x}
    parts = {
        name: max((abs(_sizes(form)[name] / x - 1) for form in item.forms), default=0.0)
        for name, x in first.items()
    }
    effect = catalogue()[h.effect]
    unseen = effect.unobserved_fraction(h, float(slow[h.joints[0]]))
    if unseen > 0.0:
        parts |= {c.name: float(np.hypot(parts[c.name], unseen)) for c in h.coefficients}
    if effect.same_number is not None:
        coefficient, setting = effect.same_number
        if first.get(coefficient):
            apart = abs(h.numbers[setting] / first[coefficient] - 1.0)
            parts[coefficient] = float(np.hypot(parts[coefficient], apart))
    return parts


def _bend_errors(
    rows: WindowedRows, end: CurrentFit, now: Fit, hypotheses: Sequence[Candidate], index: int
) -> dict[str, float]:
    """Relative change of an effect's coefficients with another form of it, or its next term."""
    h, values = hypotheses[index], now.effects[index]
    form = catalogue()[h.effect].alternative_form(h, values)
    if form is None:
        return {}
    more = [form if i == index else other for i, other in enumerate(hypotheses)]
    table = build_design_matrix(rows, end.model, more)
    choice = replace(now.choice, slots=tuple(table.slots[i] for i in range(len(more))))
    bent = fit(table.grams.of(range(FOLDS)), choice, now.sigma).effects[index]
    return {
        c.name: abs(float(new / old - 1))
        for c, old, new in zip(h.coefficients, values, bent, strict=False)
        if old
    }


def _sizes(score: Score) -> dict[str, float]:
    """Coefficients and settings of a score, by name."""
    names = [c.name for c in score.hypothesis.coefficients]
    return dict(zip(names, map(float, score.values), strict=True)) | score.hypothesis.numbers


def _tunable(h: Candidate) -> list[str]:
    """Settings of a hypothesis that the data may still move."""
    numbers = h.numbers
    return [
        s.name
        for s in catalogue()[h.effect].nonlinear
        if s.name in numbers and s.is_parameter and not s.discrete
    ]


def _linearised(
    rows: WindowedRows,
    end: CurrentFit,
    hypotheses: Sequence[Candidate],
    tunable: Sequence[list[str]],
) -> tuple[Table, Fit, list[list[Array]]]:
    """The fit on all data, and each setting's columns, per joint, shape (R,)."""
    moved = [
        catalogue()[h.effect].moved(h, {name: h.numbers[name] * (1 + sign * _STEP)})
        for h, names in zip(hypotheses, tunable, strict=True)
        for name in names
        for sign in (1, -1)
    ]
    table = build_design_matrix(rows, end.model, hypotheses, moved)
    choice = replace(end.fit.choice, slots=tuple(table.slots[i] for i in range(len(hypotheses))))
    now = fit(table.grams.of(range(FOLDS)), choice, end.fit.sigma)
    slopes, place = [], len(hypotheses)
    for h, names, theta in zip(hypotheses, tunable, now.effects, strict=True):
        for name in names:
            up, down = (_torque(table, place + k, theta) for k in (0, 1))
            width = 2 * _STEP * h.numbers[name]
            slopes.append([(a - b) / width for a, b in zip(up, down, strict=True)])
            place += 2
    return table, now, slopes


def _torque(table: Table, index: int, theta: Array) -> list[Array]:
    """Torque of a hypothesis per joint, shape (R,)."""
    slot = table.slots[index]
    found: list[Array] = [np.zeros(len(c)) for c in table.columns]
    for j, start in zip(slot.joints, slot.starts, strict=True):
        first = table.grams.layouts[j].first_extra + start
        found[j] = table.columns[j][:, first : first + slot.width] @ theta
    return found


def _solution(
    rows: WindowedRows, table: Table, now: Fit, slopes: list[list[Array]]
) -> tuple[Array, Array]:
    """Unknowns with the steps of the settings appended, and their covariance."""
    size, more = len(now.x), len(slopes)
    total = size + more
    normal, right = np.zeros((total, total)), np.zeros(total)
    block = _blocks(rows, table)
    scores = np.zeros((block.max() + 1, total))
    for j, pl in enumerate(places(table.grams, now.choice)):
        columns = table.columns[j]
        if len(columns) == 0:
            continue
        weight = (table.fold != EXCLUDED) / now.sigma[j][table.region[:, j]] ** 2
        model = pl.of(columns)
        own = np.column_stack([model, *(s[j] for s in slopes)])
        where = np.concatenate([pl.unknown, size + np.arange(more)])
        error = columns[:, -1] - model @ now.x[pl.unknown]
        weighted = own * weight[:, None]
        normal[np.ix_(where, where)] += own.T @ weighted
        right[where] += weighted.T @ columns[:, -1]
        parts = np.zeros((len(scores), len(where)))
        np.add.at(parts, block, weighted * error[:, None])
        scores[:, where] += parts
    x = solve(normal, right)
    inverse = solve(normal, np.eye(total))
    count = len(np.unique(block))
    inflation = count / max(count - total / table.grams.dof, 1.0)
    covariance = inverse @ (scores.T @ scores) @ inverse.T * inflation
    return x, covariance


def _blocks(rows: WindowedRows, table: Table) -> NDArray[np.int64]:
    """Number of the block of time that each row lies in, shape (R,)."""
    start = np.array([s.t[0] for s in rows.segments])
    within = np.floor((table.t - start[table.segment]) / _BLOCK_S).astype(int)
    return np.unique(table.segment * (within.max() + 1) + within, return_inverse=True)[1]


def _gauss_newton_step(
    hypotheses: Sequence[Candidate], tunable: Sequence[list[str]], steps: Array
) -> tuple[Candidate, ...]:
    """The hypotheses with their settings moved, within bounds and never far."""
    moved, place = [], 0
    for h, names in zip(hypotheses, tunable, strict=True):
        numbers, effect = h.numbers, catalogue()[h.effect]
        known = {s.name: s for s in effect.nonlinear}
        changes = {}
        for name in names:
            value = numbers[name]
            step = float(np.clip(steps[place], -_MOST * abs(value), _MOST * abs(value)))
            changes[name] = float(np.clip(value + step, known[name].lower, known[name].upper))
            place += 1
        moved.append(effect.moved(h, changes))
    return tuple(moved)


def _named(
    hypotheses: Sequence[Candidate], tunable: Sequence[list[str]], now: Fit, sd: Array
) -> list[dict[str, Value]]:
    first = len(now.x) - sum(len(h.coefficients) for h in hypotheses)
    last = len(now.x)
    found = []
    for h, names, theta in zip(hypotheses, tunable, now.effects, strict=True):
        effect = catalogue()[h.effect]
        units = {s.name: s.unit for s in effect.nonlinear}
        values = {}
        for c, value in zip(h.coefficients, theta, strict=True):
            if value != 0.0 or sd[first] > 0.0:  # else a column that this form does not have
                values[c.name] = Value(float(value), float(sd[first]), c.unit)
            first += 1
        for name in names:
            values[name] = Value(h.numbers[name], float(sd[last]), units[name])
            last += 1
        for s in effect.nonlinear:
            if s.discrete and s.is_parameter and s.name in h.numbers:
                values[s.name] = Value(h.numbers[s.name], 0.0, s.unit)  # chosen, not estimated
        found.append(effect.as_reported(h, values))
    return found
