"""Scores of all hypotheses: how much each shrinks the residual, everything else fitted again."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.reversal_friction import best_mixture, parts_of
from ident.gap.regression.design_matrix import Table
from ident.gap.regression.normal_equations import NormalEquations
from ident.gap.regression.weighted_fit import ColumnIndex, Fit, ModelStructure, fit, places, solve

Array = NDArray[np.floating]

EXACT_PER_PLACE = 3
_LEAST = 0.005  # nats per sample at the present noise: what gains less is not worth an exact fit
_SETTLED = 0.01  # change of a part of the reversal curves
_TIE = 1e-9
_ABSORBED = 1e-6  # of a column's square: less is rounding
_COST = 0.01  # nats per further coefficient


@dataclass(frozen=True)
class Score:
    """One hypothesis with everything fitted again.

    Attributes:
        index: of the hypothesis in the table.
        hypothesis: what was tried.
        fit: the solution with it.
        gain: nats per sample, see `Fit.gain_over`.
    """

    index: int
    hypothesis: Candidate
    fit: Fit
    gain: float

    @property
    def penalised_gain(self) -> float:
        """The gain less a cost for each coefficient beyond the first."""
        return self.gain - _COST * (len(self.values) - 1)

    @property
    def values(self) -> Array:
        """The coefficients, shape (k,)."""
        return self.fit.effects[-1]


def choose_shapes(grams: NormalEquations, choice: ModelStructure, rounds: int = 4) -> Fit:
    """The fit with the reversal curves of each joint that leave the least."""
    found = fit(grams, choice)
    for _ in range(rounds):
        shapes = found.choice.shapes.copy()
        for j in range(grams.dof):
            if grams.counts[j].sum() > 0:
                count = grams.layouts[j].turnings
                reduced, torque = _orthogonalised(grams, found, j)
                weights, _ = best_mixture(reduced[:count, :count], torque[:count])
                shapes[j] = parts_of(weights, shapes[j])
        change = np.abs(shapes - found.choice.shapes).max()
        found = fit(grams, ModelStructure(shapes, choice.slots), found.sigma)
        if change < _SETTLED:
            break
    return found


def _orthogonalised(grams: NormalEquations, present: Fit, joint: int) -> tuple[Array, Array]:
    """Weighted products of a joint's reversal curves and candidates, all else projected off.

    Returns:
        products, shape (m, m), and products with the torque, shape (m,); the joint's present
        curves are not among what is projected off. What projection leaves nothing of is zero.
    """
    layout = grams.layouts[joint]
    weight = 1 / present.sigma[joint] ** 2
    products = np.tensordot(weight, grams.products[joint][0], axes=1)
    here = places(grams, present.choice)[joint]
    without = grams.base + grams.dof + joint
    keep = np.arange(len(present.normal)) != without
    free = slice(layout.first_turning, layout.torque)
    size = layout.torque - layout.first_turning
    across = np.zeros((len(present.normal), size))
    across[here.unknown] = here.across(products, np.arange(free.start, free.stop))
    # the torque's own projection: the present solution explains normal @ x of it
    right = present.normal @ present.x
    both = np.column_stack([across, right])[keep]
    inverse = solve(present.normal[np.ix_(keep, keep)], both)
    reduced = products[free, free] - across[keep].T @ inverse[:, :-1]
    torque = products[free, layout.torque] - across[keep].T @ inverse[:, -1]
    absorbed = np.diag(reduced) <= _ABSORBED * np.diag(products)[free]
    reduced[absorbed], reduced[:, absorbed], torque[absorbed] = 0.0, 0.0, 0.0
    return reduced, torque


def scan(
    table: Table, present: Fit, accepted: int = 0, exact: int = EXACT_PER_PLACE
) -> list[Score]:
    """Scores of the best hypotheses of each effect and place, best first.

    Args:
        table: inner products, of the data to use as one fold.
        present: the model so far.
        accepted: so many hypotheses of the table, the first ones, are in the model already.
        exact: so many hypotheses of each effect and place are fitted exactly.
    """
    grams = table.grams
    tried: list[tuple[int, ModelStructure]] = []
    for j in range(grams.dof):
        if grams.counts[j].sum() > 0:
            tried += _shortlist(table, present, j, accepted, exact)
    for i, h in enumerate(table.hypotheses[accepted:], accepted):
        if len(h.rows) > 1:
            tried.append((i, present.choice.with_slot(table.slots[i])))
    scores = [_score(table, present, i, choice) for i, choice in tried]
    return sorted((s for s in scores if s is not None), key=lambda s: -s.penalised_gain)


def _shortlist(
    table: Table, present: Fit, joint: int, accepted: int, exact: int
) -> list[tuple[int, ModelStructure]]:
    """The most promising hypotheses on one joint, each with its best reversal curves."""
    grams, layout = table.grams, table.grams.layouts[joint]
    reduced, torque = _orthogonalised(grams, present, joint)
    own = present.choice.shapes[joint]
    alone = best_mixture(reduced[: len(own), : len(own)], torque[: len(own)])[1]
    by_effect: dict[str, list[tuple[float, int, Array]]] = {}
    for i, h in enumerate(table.hypotheses[accepted:], accepted):
        if h.rows == (joint,):
            gain, weights = gain_with(reduced, torque, layout.turnings, table.slots[i], h)
            by_effect.setdefault(h.effect, []).append((gain - alone, i, weights))
    short = []
    rows = int(grams.counts[joint].sum())
    for found in by_effect.values():
        for gain, i, weights in sorted(found, key=lambda x: -x[0])[:exact]:
            if gain > _LEAST * rows:
                shape = parts_of(weights, own)
                short.append((i, present.choice.turned(joint, shape).with_slot(table.slots[i])))
    return short


def gain_with(
    reduced: Array, torque: Array, turnings: int, slot: ColumnIndex, hypothesis: Candidate
) -> tuple[float, Array]:
    """Half the drop of weighted squares for a hypothesis and the reversal curves that suit it.

    Args:
        reduced: inner products of a joint's curves and candidates, all else projected off.
        torque: the same with the torque.
        turnings: number of reversal curves T.
        slot: the hypothesis' columns.
        hypothesis: what they are.

    Returns:
        the drop, zero for implausible coefficients, and the curves' weights, shape (T,).
    """
    own = turnings + slot.starts[0] + np.arange(slot.width)
    inner = reduced[np.ix_(own, own)]
    nothing = 0.0, np.zeros(turnings)
    if (np.diag(inner) <= 0.0).any():
        return nothing
    inner = inner + _TIE * np.diag(np.diag(inner))
    across = reduced[:turnings, own]
    back = np.linalg.solve(inner, np.column_stack([across.T, torque[own]]))
    weights, drop = best_mixture(
        reduced[:turnings, :turnings] - across @ back[:, :-1],
        torque[:turnings] - across @ back[:, -1],
    )
    values = back[:, -1] - back[:, :-1] @ weights
    if not _plausible(values, hypothesis):
        return nothing
    return drop + float(torque[own] @ back[:, -1]) / 2, weights


def _plausible(values: Array, hypothesis: Candidate) -> bool:
    pairs = zip(values, hypothesis.coefficients, strict=True)
    return all(c.lower <= v <= c.upper for v, c in pairs)


def is_plausible(candidate: Candidate, found: Fit, tuned: bool) -> bool:
    """Whether the effect that a fit has last can be meant, by its own judgement."""
    viscous = float(found.viscous[candidate.joints[0]])
    return catalogue()[candidate.effect].is_plausible(candidate, found.effects[-1], viscous, tuned)


def _score(table: Table, present: Fit, index: int, choice: ModelStructure) -> Score | None:
    hypothesis = table.hypotheses[index]
    found = fit(table.grams, choice, present.sigma)
    if not _plausible(found.effects[-1], hypothesis) or not is_plausible(hypothesis, found, False):
        return None
    return Score(index, hypothesis, found, found.gain_over(present))


def noise_gains(table: Table, now: Fit, draws: list[Array], accepted: int) -> dict[str, Array]:
    """Largest gain of each effect when the residual is only noise, per draw.

    Args:
        table: with all rows' columns.
        now: fit on the searched data.
        draws: noise per joint, shape (R, D) [N m]; rows that are not searched are zero.
        accepted: so many hypotheses of the table are in the model already.
    """
    grams = table.grams
    best: dict[str, Array] = {}
    for j, layout in enumerate(grams.layouts):
        if grams.counts[j].sum() == 0 or len(draws[j]) == 0:
            continue
        weight = 1 / now.sigma[j][table.region[:, j]] ** 2 * (draws[j] != 0.0).any(axis=1)
        columns = table.columns[j]
        here = places(grams, now.choice)[j]
        weighted = columns * weight[:, None]
        across = np.zeros((len(now.normal), columns.shape[1]))
        model = here.of(columns)
        across[here.unknown] = model.T @ weighted
        inverse = solve(now.normal, across)
        noise = weighted.T @ draws[j]
        right = noise - inverse[here.unknown].T @ (here.mix.T @ noise[here.local])
        square = np.einsum("rp,rp->p", columns, weighted) - np.einsum("up,up->p", across, inverse)
        raw = np.einsum("rp,rp->p", columns, weighted)
        rows = int((weight > 0).sum())
        for i, h in enumerate(table.hypotheses[accepted:], accepted):
            if h.rows != (j,):
                continue
            c = layout.first_extra + table.slots[i].starts[0] + np.arange(table.slots[i].width)
            if (square[c] <= 1e-9 * raw[c]).any():
                continue
            if len(c) == 1:
                gains = right[c[0]] ** 2 / square[c[0]] / 2 / rows
            else:
                inner = columns[:, c].T @ weighted[:, c] - across[:, c].T @ inverse[:, c]
                inner = inner + 1e-9 * np.diag(raw[c])
                gains = np.einsum("kd,kd->d", right[c], np.linalg.solve(inner, right[c])) / 2 / rows
            best[h.effect] = np.maximum(best.get(h.effect, 0.0), gains)
    return best
