"""The model so far, and the next effect: fit, score, refine, take in."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.catalogue import catalogue
from ident.effects.effect import ArmFacts, Effect, Hypothesis
from ident.gap.fit import Choice, Fit, fit
from ident.gap.region import SLOW, slow_speed
from ident.gap.scan import Score, choose_turnings, scan
from ident.gap.table import Nominal, PresentModel, Table, tabulate
from ident.gap.turning import TURNINGS, USUAL

Array = NDArray[np.floating]

SEARCHED = (0, 1)
"""Folds on which effects are looked for; the last one is held out."""

_REFINEMENTS = 2
_FINER = 7  # points of each refinement


@dataclass(frozen=True)
class Present:
    """The model so far.

    Attributes:
        model: what columns of effects are formed with.
        accepted: effects in the model.
        fit: on the folds that are searched.
    """

    model: PresentModel
    accepted: tuple[Hypothesis, ...]
    fit: Fit


def begin(rows: Nominal, facts: ArmFacts) -> Present:
    """The rigid-body model with viscous and Coulomb friction."""
    none = np.zeros(facts.dof)
    slow = np.full(facts.dof, SLOW[0])
    model = PresentModel(facts, none, none, (USUAL,) * facts.dof, slow)
    return _settled(rows, Present(model, (), _empty(facts.dof)))


def _empty(dof: int) -> Fit:
    none = np.zeros((dof, 1))
    return Fit(Choice((USUAL,) * dof), none[0], none, none.astype(int), none)


def extend(rows: Nominal, present: Present, hypotheses: Sequence[Hypothesis]) -> Present:
    """The model with more effects, everything fitted again."""
    return _settled(rows, replace(present, accepted=(*present.accepted, *hypotheses)))


def _settled(rows: Nominal, present: Present) -> Present:
    """Reversal shapes, regions, and parameters that agree with each other."""
    for _ in range(2):
        table = tabulate(rows, present.model, present.accepted)
        choice = Choice(present.model.turnings, tuple(table.slots.values()))
        found = choose_turnings(table.grams.of(SEARCHED), choice)
        present = Present(_updated(rows, present.model, found), present.accepted, found)
    return present


def _updated(rows: Nominal, model: PresentModel, found: Fit) -> PresentModel:
    b, n = len(rows.kept), model.facts.dof
    delta = np.zeros_like(model.facts.delta)
    delta[rows.kept] = found.x[:b]
    turnings = found.choice.turnings
    return PresentModel(
        replace(model.facts, delta=delta),
        found.x[b : b + n],
        found.x[b + n : b + 2 * n],
        turnings,
        np.array([slow_speed(TURNINGS[t].width) for t in turnings]),
    )


def all_hypotheses(facts: ArmFacts) -> list[Hypothesis]:
    """Everything that the catalogue can look for in recordings alone."""
    return [h for e in catalogue().values() if not e.compares for h in e.hypotheses(facts)]


def examine(
    rows: Nominal, present: Present, hypotheses: Sequence[Hypothesis]
) -> tuple[Table, list[Score]]:
    """Scores of hypotheses beside the model so far, on the folds that are searched."""
    table = tabulate(rows, present.model, [*present.accepted, *hypotheses])
    searched = table.searched(SEARCHED)
    accepted = len(present.accepted)
    choice = Choice(present.model.turnings, tuple(table.slots[i] for i in range(accepted)))
    now = fit(searched.grams, choice, present.fit.sigma)
    return table, scan(searched, now, accepted)


def refined(rows: Nominal, present: Present, score: Score) -> Score:
    """The same effect at the same place with its settings tuned."""
    effect = catalogue()[score.hypothesis.effect]
    for width in range(_REFINEMENTS):
        near = _neighbours(effect, score.hypothesis, width)
        if not near:
            return score
        _, found = examine(rows, present, [score.hypothesis, *near])
        score = found[0] if found and found[0].merit > score.merit else score
    return score


def _neighbours(effect: Effect, hypothesis: Hypothesis, finer: int) -> list[Hypothesis]:
    """Hypotheses with one setting moved by less than the step of its grid."""
    near = []
    for setting in effect.settings:
        if setting.name not in hypothesis.settings or len(setting.grid) < 2 or setting.whole:
            continue
        value = hypothesis.settings[setting.name]
        step = np.diff(np.log(np.abs(setting.grid))).max() / 4**finer
        for factor in np.exp(np.linspace(-step, step, _FINER)):
            other = float(np.clip(abs(value) * factor, setting.lower, setting.upper))
            changed = {**hypothesis.settings, setting.name: float(np.copysign(other, value))}
            near.append(replace(hypothesis, settings=changed))
    return near
