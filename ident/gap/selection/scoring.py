"""Score candidates: how much each shrinks the residual, with everything else fitted again.

A score is the gain of the log-likelihood per sample. All candidates are first scored approximately
(a score test: everything but the joint's own reversal curves is projected off); the best ones of
each effect and place are then fitted exactly.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.reversal_friction import best_mixture, parts_of
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.model_columns import ColumnIndex, ModelStructure, joint_columns
from ident.gap.regression.projection import project_off
from ident.gap.regression.reversal_curves import curves_beside, orthogonalised
from ident.gap.regression.stacked_equations import StackedEquations, stacked
from ident.gap.regression.weighted_fit import Fit, fit_stacked
from ident.gap.settings import Scoring
from ident.signals.arrays import Array

EXACT_PER_PLACE = 3
"""Candidates of each effect and place that are fitted exactly."""

_RIDGE = 1e-9
_ABSORBED = 1e-9  # of a column's square: less is rounding


@dataclass(frozen=True)
class Score:
    """One candidate with everything fitted again.

    Attributes:
        index: of the candidate in the design matrix.
        candidate: what was tried.
        fit: the solution with it.
        gain: [nats per sample], see `Fit.gain_over`.
        penalised_gain: the gain less a cost for each coefficient after the first.
    """

    index: int
    candidate: Candidate
    fit: Fit
    gain: float
    penalised_gain: float

    @property
    def values(self) -> Array:
        """The coefficients, shape (k,)."""
        return self.fit.effects[-1]


def main_joints(score: Score, before: Fit, settings: Scoring) -> tuple[int, ...]:
    """The joints that carry most of a score's gain, from 0."""
    gains = score.fit.gains_over(before)
    least = settings.main_joint_share * max(gains.max(), 1e-12)
    return tuple(int(j) for j in np.flatnonzero(gains >= least))


def is_plausible(candidate: Candidate, found: Fit, tuned: bool) -> bool:
    """Whether the effect itself accepts the last coefficients of a fit."""
    joint = candidate.joints[0]
    friction = float(found.viscous[joint]), float(found.coulomb[joint])
    effect = catalogue()[candidate.effect]
    return effect.is_plausible(candidate, found.effects[-1], friction, tuned)


def is_too_small(score: Score) -> bool:
    """Whether all coefficients are below the smallest size that the effect reports."""
    sizes = zip(score.values, score.candidate.coefficients, strict=True)
    return all(abs(value) < c.min_size for value, c in sizes)


def score_candidates(
    design: DesignMatrix, now: Fit, settings: Scoring, exact: int = EXACT_PER_PLACE
) -> list[Score]:
    """Scores of the best candidates of each effect and place, best first.

    Args:
        design: inner products of the data to use, as one fold.
        now: the current fit.
        settings: of the scoring.
        exact: candidates of each effect and place that are fitted exactly.
    """
    tried: list[tuple[int, ModelStructure]] = []
    for j in range(design.equations.dof):
        if design.equations.counts[j].sum() > 0:
            tried += _shortlist(design, now, j, settings, exact)
    for i, h in enumerate(design.effects):
        if i >= design.accepted and len(h.rows) > 1:
            tried.append((i, now.structure.with_effect(design.index[i])))
    model = stacked(design.equations, now.structure)
    scores = [_exact(design, now, i, model.beside(s), settings) for i, s in tried]
    return sorted((s for s in scores if s is not None), key=lambda s: -s.penalised_gain)


def _shortlist(
    design: DesignMatrix, now: Fit, joint: int, settings: Scoring, exact: int
) -> list[tuple[int, ModelStructure]]:
    """The most promising candidates on one joint, each with its best reversal curves."""
    equations = design.equations
    reduced, torque = orthogonalised(equations, now, joint)
    own = now.structure.shapes[joint]
    accepted, dof = design.effects[: design.accepted], equations.dof
    usable = curves_beside(accepted, dof)[joint]
    alone = best_mixture(reduced[: len(own), : len(own)], torque[: len(own)], usable)[1]
    by_effect: dict[str, list[tuple[float, int, Array]]] = {}
    for i, h in enumerate(design.effects):
        if i >= design.accepted and h.rows == (joint,):
            beside = curves_beside((*accepted, h), dof)[joint]
            gain, weights = _gain_with(reduced, torque, beside, design.index[i], h)
            by_effect.setdefault(h.effect, []).append((gain - alone, i, weights))
    short = []
    rows = int(equations.counts[joint].sum())
    for found in by_effect.values():
        for gain, i, weights in sorted(found, key=lambda x: -x[0])[:exact]:
            if gain > settings.min_shortlist_gain * rows:
                structure = now.structure.with_shape(joint, parts_of(weights, own))
                short.append((i, structure.with_effect(design.index[i])))
    return short


def _gain_with(
    reduced: Array,
    torque: Array,
    usable: NDArray[np.bool_],
    index: ColumnIndex,
    candidate: Candidate,
) -> tuple[float, Array]:
    """Half the drop of weighted squares with a candidate and its best reversal curves.

    Args:
        reduced: inner products of a joint's curves and candidates, all else projected off.
        torque: the same with the torque.
        usable: reversal curves that may be mixed beside it, shape (T,).
        index: the candidate's columns.
        candidate: what they are.

    Returns:
        the drop, zero for coefficients outside their bounds, and the curves' weights, shape (T,).
    """
    reversals = len(usable)
    own = reversals + index.starts[0] + np.arange(index.width)
    inner = reduced[np.ix_(own, own)]
    nothing = 0.0, np.zeros(reversals)
    if (np.diag(inner) <= 0.0).any():
        return nothing
    inner = inner + _RIDGE * np.diag(np.diag(inner))
    across = reduced[:reversals, own]
    back = np.linalg.solve(inner, np.column_stack([across.T, torque[own]]))
    weights, drop = best_mixture(
        reduced[:reversals, :reversals] - across @ back[:, :-1],
        torque[:reversals] - across @ back[:, -1],
        usable,
    )
    values = back[:, -1] - back[:, :-1] @ weights
    if not _within_bounds(values, candidate):
        return nothing
    return drop + float(torque[own] @ back[:, -1]) / 2, weights


def _within_bounds(values: Array, candidate: Candidate) -> bool:
    pairs = zip(values, candidate.coefficients, strict=True)
    return all(c.lower <= v <= c.upper for v, c in pairs)


def _exact(
    design: DesignMatrix, now: Fit, index: int, model: StackedEquations, settings: Scoring
) -> Score | None:
    candidate = design.effects[index]
    found = fit_stacked(model, now.sigma)
    if not _within_bounds(found.effects[-1], candidate):
        return None
    if not is_plausible(candidate, found, tuned=False):
        return None
    gain = found.gain_over(now)
    cost = settings.cost_per_coefficient * (len(candidate.coefficients) - 1)
    return Score(index, candidate, found, gain, gain - cost)


def noise_gains(design: DesignMatrix, now: Fit, draws: list[Array]) -> dict[str, Array]:
    """Largest approximate gain of each effect when the residual is only noise, per draw.

    Args:
        design: with all rows' columns.
        now: fit on the searched data.
        draws: noise per joint, shape (R, D) [N m]; rows that are not searched are zero.
    """
    best: dict[str, Array] = {}
    for j, columns in enumerate(design.columns):
        if design.equations.counts[j].sum() == 0 or len(draws[j]) == 0:
            continue
        weight = 1 / now.sigma[j][design.region[:, j]] ** 2 * (draws[j] != 0.0).any(axis=1)
        here = joint_columns(design.equations, now.structure)[j]
        weighted = columns * weight[:, None]
        across = np.zeros((len(now.normal), columns.shape[1]))
        across[here.unknown] = here.of(columns).T @ weighted
        raw = columns.T @ weighted
        left, absorbed = project_off(now.normal, across, raw)
        noise = weighted.T @ draws[j]
        right = noise - absorbed[here.unknown].T @ (here.mix.T @ noise[here.local])
        square, rows = np.diag(raw), int((weight > 0).sum())
        for i, h in enumerate(design.effects):
            if i < design.accepted or h.rows != (j,):
                continue
            own = design.places(i, j)
            inner = left[own, own]
            if (np.diag(inner) <= _ABSORBED * square[own]).any():
                continue
            if len(inner) > 1:
                inner = inner + _RIDGE * np.diag(square[own])
            solved = np.linalg.solve(inner, right[own])
            gains = np.einsum("kd,kd->d", right[own], solved) / 2 / rows
            best[h.effect] = np.maximum(best.get(h.effect, 0.0), gains)
    return best
