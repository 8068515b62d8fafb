"""Is an effect sure enough to be named? Its size is judged in the final fit, beside all others.

A gain of the likelihood tells that an effect helps prediction, not that it is there: a small error
of the model's form helps as well. To be named, an effect must surely not be zero, by standard
errors that know of correlated residuals, of the forms which the data cannot tell apart, and of the
difference between recordings; it must reach the torque's resolution, explain a share of the joint's
friction, and carry over between recordings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.effects.candidate import Candidate, Value
from ident.gap.data.blocks import FOLDS
from ident.gap.data.experiment import Experiment
from ident.gap.data.rounding import torque_resolution
from ident.gap.naming.across_recordings import across_recordings, with_spread
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.feasible_fit import feasible_fit
from ident.gap.regression.weighted_fit import Fit, fit, mean_squares
from ident.gap.selection.acceptance import next_effects
from ident.gap.selection.candidates import special_cases
from ident.gap.selection.estimates import (
    estimates_with_fixed_parameters,
    final_estimates,
    free_parameters,
)
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.settings import GapSettings, Naming
from ident.signals.arrays import Array

IMPOSSIBLE_ARM = "no arm whose friction always brakes explains these recordings, with or without it"
"""Why nothing is named beside such an arm, in half a sentence."""


@dataclass(frozen=True)
class Certainty:
    """How sure one effect is, in the final fit beside all others.

    Attributes:
        deviations: its size in standard deviations.
        peak: its largest torque in any row [N m].
        resolution: of the recorded torque at the joint of that row [N m].
        explained: rms torque that it explains beyond all others, at its best joint [N m].
        friction: Coulomb friction of that joint [N m].
        residual: rms residual of that joint away from its reversals [N m].
        across: gain on recordings that it was not fitted to [nats per sample]; None for one
            recording.
        held: its size in standard deviations with its nonlinear parameters held; None without any.
        moved: how far its size moves beside links that are physically possible, in standard
            deviations.
        in_bounds: whether its coefficients are such as the effect can have.
    """

    deviations: float
    peak: float
    resolution: float
    explained: float
    friction: float
    residual: float
    across: float | None = None
    held: float | None = None
    moved: float = 0.0
    in_bounds: bool = True

    def is_there(self, settings: GapSettings) -> bool:
        """Whether all that is unsure is how large it is.

        A size that trades with a nonlinear parameter may be as uncertain as it is large, in the one
        way of writing the effect and not in another. That it is not zero is told with the parameter
        held, by a stricter bound.
        """
        if self.held is None or self.held < settings.significance.z_fixed_settings:
            return False
        return not replace(self, deviations=self.held).doubt(settings.naming)

    def doubt(self, asked: Naming) -> str:
        """Why it may not be named, in half a sentence; empty if it may."""
        if self.deviations < asked.z:
            told = np.floor(10 * self.deviations) / 10  # 2.97 is less than the 3 that are asked for
            return (
                f"its size is {told:.1f} standard deviations from zero, and"
                f" {asked.z:g} are asked for"
            )
        if not self.in_bounds:
            return "beside the others its size is none that such an effect can have"
        if self.moved > asked.z:
            return (
                f"beside links that are physically possible its size is {self.moved:.1f} standard"
                " deviations from this one: the two trade with each other"
            )
        if self.peak < self.resolution:
            return (
                f"its torque is at most {self.peak:.2g} N m, below the recorded torque's"
                f" resolution of {self.resolution:.2g} N m"
            )
        if self.peak < asked.min_friction_share * self.friction and (
            self.explained < asked.min_residual_share * self.residual
        ):
            return (
                f"its torque is at most {self.peak:.2g} N m, less than"
                f" {100 * asked.min_friction_share:g} % of the joint's friction, and it explains"
                f" less than {100 * asked.min_residual_share:g} % of what is left"
            )
        if self.across is not None and self.across <= 0.0:
            return "a recording that it was not fitted to is predicted no better with it"
        return ""


@dataclass(frozen=True)
class Suspected:
    """An effect that helps prediction and is not sure enough to be named.

    Attributes:
        effect: as it was accepted.
        parameters: its values beside all others, by name.
        certainty: how sure it is.
        doubt: why it is not named; empty for one that the search did not come to, and that may be.
        in_model: whether it is in the model all the same.
    """

    effect: AcceptedEffect
    parameters: dict[str, Value]
    certainty: Certainty
    doubt: str
    in_model: bool = False

    @property
    def candidate(self) -> Candidate:
        """The effect at its place."""
        return self.effect.candidate


def set_apart(
    source: Experiment, state: SelectionState, settings: GapSettings
) -> tuple[SelectionState, tuple[Suspected, ...]]:
    """The effects that are sure, with the model that they stand in, and the others.

    The others leave one at a time, the least sure first, since the rest may be surer without it.
    One beside which another effect is sure, and without which it would not be, stays in the model,
    and so does one of which only the size is unsure. Where one leaves, a special case of it may be
    sure in its place: the torque of a spring at zero, say, if not its stiffness.
    """
    apart: list[Suspected] = []
    needed: list[AcceptedEffect] = []
    found = _judged(source, state, settings)
    while unsure := [s for s in found if s.doubt and not _holds(needed, s.effect)]:
        worst = min(unsure, key=lambda s: s.certainty.deviations)
        if worst.certainty.is_there(settings):
            needed.append(worst.effect)
            continue
        without = state.with_only([s.effect for s in found if s is not worst])
        again = _judged(source, without, settings)
        sure = [s.effect for s in found if not s.doubt]
        if any(s.doubt and _holds(sure, s.effect) for s in again):
            needed.append(worst.effect)
            continue
        apart.append(worst)
        state, found = without, again
        simpler = _special_case(source, state, worst.candidate, settings)
        if simpler is not None:
            state, found = simpler
    kept = [replace(s, in_model=True) for s in found if s.doubt]
    return state, (*kept, *apart)


def _special_case(
    source: Experiment, state: SelectionState, unsure: Candidate, settings: GapSettings
) -> tuple[SelectionState, list[Suspected]] | None:
    """The state with a special case of an effect that left, and all doubts, if it is sure."""
    simpler = special_cases(unsure)
    fresh, _ = next_effects(state, simpler, settings) if simpler else ([], ())
    if not fresh:
        return None
    larger = state.with_only([*state.accepted, *fresh])
    found = _judged(source, larger, settings)
    return None if any(s.doubt and _holds(fresh, s.effect) for s in found) else (larger, found)


def _holds(effects: Sequence[AcceptedEffect], effect: AcceptedEffect) -> bool:
    """Whether it is one of them; two of one kind may stand at one place."""
    return any(e is effect for e in effects)


def sure_in_the_end(
    source: Experiment,
    state: SelectionState,
    apart: Sequence[Suspected],
    settings: GapSettings,
) -> tuple[SelectionState, tuple[Suspected, ...]]:
    """The whole model, named effects first, and what is suspected.

    What joined the model after the others were found sure may share their size, and what a standard
    error holds beside noise counts here, as in what is told. They stay in it, without a name.

    Args:
        source: the recordings.
        state: with the effects that were found sure.
        apart: what is suspected, in the model or not.
        settings: of the search.
    """
    inside = [s for s in apart if s.in_model]
    named = not_among(inside, state.accepted)
    whole = state.with_only([*named, *(s.effect for s in inside)])
    found = _judged(source, whole, settings, systematic=True)
    lost = [replace(s, in_model=True) for s in found[: len(named)] if s.doubt]
    if lost:
        others = [s.effect for s in (*lost, *inside)]
        whole = state.with_only([*not_among(lost, named), *others])
    return whole, (*lost, *apart)


def not_among(
    suspected: Sequence[Suspected], effects: Sequence[AcceptedEffect]
) -> list[AcceptedEffect]:
    """The effects that are not suspected."""
    return [a for a in effects if not _holds([s.effect for s in suspected], a)]


def withheld(
    source: Experiment, state: SelectionState, settings: GapSettings, in_model: bool, doubt: str
) -> tuple[SelectionState, tuple[Suspected, ...]]:
    """All effects suspected only.

    Args:
        source: the recordings.
        state: with what was found.
        settings: of the search.
        in_model: whether the effects stay in the model.
        doubt: why none is named, in half a sentence.
    """
    found = _judged(source, state, settings)
    apart = tuple(replace(s, doubt=doubt, in_model=in_model) for s in found)
    return state if in_model else state.with_only([]), apart


def _judged(
    source: Experiment, state: SelectionState, settings: GapSettings, systematic: bool = False
) -> list[Suspected]:
    """All accepted effects, with their doubts."""
    judged = certainties(source, state, settings, systematic)
    return [
        Suspected(a, values, c, c.doubt(settings.naming))
        for a, (values, c) in zip(state.accepted, judged, strict=True)
    ]


def certainties(
    source: Experiment, state: SelectionState, settings: GapSettings, systematic: bool = False
) -> list[tuple[dict[str, Value], Certainty]]:
    """Values of each effect, and how sure they are, by the errors that are reported or tested."""
    if not state.accepted:
        return []
    rows, end = state.rows, state.current
    of_size = [replace(a, near_forms=()) for a in state.accepted]  # how large, not whether
    final = final_estimates(rows, end, settings.significance, of_size, systematic)
    design = replace(end, accepted=final.effects).design(rows)
    across = across_recordings(design, rows, final.fit, settings.cross_validation)
    resolution = torque_resolution(source)
    fixed: Sequence[dict[str, Value]] = []
    if any(map(free_parameters, final.effects)):
        tuned = replace(end, accepted=final.effects)
        fixed = estimates_with_fixed_parameters(rows, tuned, settings.significance)
    possible = feasible_fit(source, final.fit, len(rows.base_parameters)).effects
    judged = []
    for i, (h, values) in enumerate(zip(final.effects, final.parameters, strict=True)):
        wider = with_spread(h, values, across[i])
        peak, joint = _peak(design, final.fit, i)
        explained, at = _explained(design, final.fit, i)
        friction = float(abs(final.fit.coulomb[at]))
        certainty = Certainty(
            deviations(h, wider),
            peak,
            float(resolution[joint]),
            explained,
            friction,
            float(np.sqrt(mean_squares(final.fit)[at])),
            across[i].gain,
            deviations(h, with_spread(h, fixed[i], across[i])) if free_parameters(h) else None,
            _moved(h, wider, final.fit.effects[i], possible[i], settings.naming),
            _in_bounds(h, wider, final.fit.effects[i]),
        )
        judged.append((wider, certainty))
    return judged


def deviations(h: Candidate, values: Mapping[str, Value]) -> float:
    """An effect's size in standard deviations: of a defining coefficient, or the surest one."""
    coefficients = [c.name for c in h.coefficients]
    defining = [c.name for c in h.coefficients if c.defining]
    known = [n for n in (defining or coefficients) if n in values]
    chosen = [values[n] for n in known] or [v for v in values.values() if v.sd > 0.0]
    return max((abs(v.value) / v.sd if v.sd > 0.0 else np.inf for v in chosen), default=0.0)


def _moved(
    h: Candidate, values: Mapping[str, Value], free: Array, possible: Array, asked: Naming
) -> float:
    """How far an effect's surest coefficient moves beside possible links, in standard deviations.

    Args:
        h: the effect.
        values: as reported.
        free: its coefficients with links of any kind, shape (k,).
        possible: the same beside physically possible links, shape (k,).
        asked: of a name.
    """
    surest = deviations(h, values)
    chosen = [k for k, c in enumerate(h.coefficients) if c.defining] or range(len(free))

    def sureness(k: int) -> float:
        own = values.get(h.coefficients[k].name)
        return abs(own.value) / own.sd if own is not None and own.sd > 0.0 else 0.0

    k = max(chosen, key=sureness, default=None)
    if k is None or free[k] == 0.0 or not np.isfinite(surest):
        return 0.0
    change = abs(possible[k] / free[k] - 1.0)
    return float(surest * change) if change > asked.possible_share else 0.0


def _in_bounds(h: Candidate, values: Mapping[str, Value], coefficients: Array) -> bool:
    """Whether all coefficients, shape (k,), are plausible within one standard deviation."""
    near = [values[c.name].sd if c.name in values else 0.0 for c in h.coefficients]
    limits = zip(h.coefficients, coefficients, near, strict=True)
    return all(c.lower - sd <= x <= c.upper + sd for c, x, sd in limits)


def _peak(design: DesignMatrix, found: Fit, index: int) -> tuple[float, int]:
    """Largest torque of an effect [N m], and the joint that feels it."""
    values = found.effects[index]
    sizes = {}
    for j in design.index[index].joints:
        torque = design.effect_columns(index, j) @ values
        sizes[j] = float(np.abs(torque).max()) if len(torque) else 0.0
    joint = max(sizes, key=lambda j: sizes[j])
    return sizes[joint], joint


def _explained(design: DesignMatrix, found: Fit, index: int) -> tuple[float, int]:
    """Rms torque that an effect explains beyond all others [N m], at the joint where most."""
    structure = found.structure
    others = tuple(e for i, e in enumerate(structure.effects) if i != index)
    rest = fit(design.equations.of(range(FOLDS)), replace(structure, effects=others), found.sigma)
    drop = np.maximum(mean_squares(rest) - mean_squares(found), 0.0)
    joint = max(design.index[index].joints, key=lambda j: drop[j])
    return float(np.sqrt(drop[joint])), joint
