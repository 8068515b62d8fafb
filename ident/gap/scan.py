"""Scores of all hypotheses: how much each shrinks the residual, everything else fitted again."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.effect import Hypothesis
from ident.gap.fit import Choice, Fit, Slot, fit, places, solve
from ident.gap.grams import Grams
from ident.gap.table import Table

Array = NDArray[np.floating]

EXACT_PER_PLACE = 3
_LEAST = 0.005  # nats per sample at the present noise: what gains less is not worth an exact fit
_NOTHING = 1e-9  # of the largest square
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
    hypothesis: Hypothesis
    fit: Fit
    gain: float

    @property
    def merit(self) -> float:
        """The gain less a cost for each coefficient beyond the first."""
        return self.gain - _COST * (self.fit.choice.slots[-1].width - 1)

    @property
    def values(self) -> Array:
        """The coefficients, shape (k,)."""
        return self.fit.effects[-1]


def choose_turnings(grams: Grams, choice: Choice, rounds: int = 4) -> Fit:
    """The fit with the reversal shape of each joint that leaves the least."""
    found = fit(grams, choice)
    for _ in range(rounds):
        before = found.choice.turnings
        turnings = []
        for j in range(grams.dof):
            gains, _ = turning_gains(grams, found, j)
            turnings.append(int(gains.argmax()) if gains.max() > 0.0 else before[j])
        found = fit(grams, Choice(tuple(turnings), choice.slots), found.sigma)
        if found.choice.turnings == before:
            break
    return found


def _reduced(grams: Grams, present: Fit, joint: int) -> tuple[Array, Array]:
    """Weighted products of a joint's reversal shapes and candidates, all else projected off.

    Returns:
        products, shape (m, m), and products with the torque, shape (m,); the joint's present
        reversal shape is not among what is projected off.
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
    across[here.unknown] = products[here.local, free]
    # the torque's own projection: the present solution explains normal @ x of it
    right = present.normal @ present.x
    both = np.column_stack([across, right])[keep]
    inverse = solve(present.normal[np.ix_(keep, keep)], both)
    reduced = products[free, free] - across[keep].T @ inverse[:, :-1]
    torque = products[free, layout.torque] - across[keep].T @ inverse[:, -1]
    return reduced, torque


def turning_gains(grams: Grams, present: Fit, joint: int) -> tuple[Array, Array]:
    """Half the drop of the weighted squares by each reversal shape, and its coefficient."""
    if grams.counts[joint].sum() == 0:
        none = np.zeros(grams.layouts[joint].turnings)
        return none, none
    reduced, torque = _reduced(grams, present, joint)
    count = grams.layouts[joint].turnings
    square = _seen(np.diag(reduced)[:count])
    coefficient = torque[:count] / square
    return np.where(coefficient > 0.0, torque[:count] ** 2 / square / 2, 0.0), coefficient


def _seen(square: Array) -> Array:
    """Squares of columns, infinite where projection has left nothing of one, shape (T,)."""
    return np.where(square > _NOTHING * max(float(square.max()), 1e-200), square, np.inf)


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
    tried: list[tuple[int, Choice]] = []
    for j in range(grams.dof):
        if grams.counts[j].sum() > 0:
            tried += _shortlist(table, present, j, accepted, exact)
    for i, h in enumerate(table.hypotheses[accepted:], accepted):
        if len(h.rows) > 1:
            tried.append((i, present.choice.with_slot(table.slots[i])))
    scores = [_score(table, present, i, choice) for i, choice in tried]
    return sorted((s for s in scores if s is not None), key=lambda s: -s.merit)


def _shortlist(
    table: Table, present: Fit, joint: int, accepted: int, exact: int
) -> list[tuple[int, Choice]]:
    """The most promising hypotheses on one joint, each with its best reversal shape."""
    grams, layout = table.grams, table.grams.layouts[joint]
    reduced, torque = _reduced(grams, present, joint)
    by_effect: dict[str, list[tuple[float, int, int]]] = {}
    for i, h in enumerate(table.hypotheses[accepted:], accepted):
        if h.rows != (joint,):
            continue
        gains = pair_gains(reduced, torque, layout.turnings, table.slots[i], h)
        best = int(gains.argmax())
        by_effect.setdefault(h.effect, []).append((float(gains[best]), i, best))
    short = []
    rows = int(grams.counts[joint].sum())
    for found in by_effect.values():
        for gain, i, turning in sorted(found, reverse=True)[:exact]:
            if gain > _LEAST * rows:
                short.append((i, present.choice.turned(joint, turning).with_slot(table.slots[i])))
    return short


def pair_gains(
    reduced: Array, torque: Array, turnings: int, slot: Slot, hypothesis: Hypothesis
) -> Array:
    """Half the drop of weighted squares for a hypothesis with each reversal shape, shape (T,)."""
    columns = turnings + slot.starts[0] + np.arange(slot.width)
    square = _seen(np.diag(reduced)[:turnings])
    across = reduced[:turnings, columns]
    rest = (
        reduced[np.ix_(columns, columns)]
        - np.einsum("ta,tb->tab", across, across) / square[:, None, None]
    )
    right = torque[columns] - across * (torque[:turnings] / square)[:, None]
    own = np.diag(reduced)[columns]
    if (own <= 0.0).any():
        return np.zeros(turnings)
    rest = rest + 1e-9 * np.diag(own)
    values = np.linalg.solve(rest, right[..., None])[..., 0]
    alone = torque[:turnings] ** 2 / square / 2
    allowed = np.all(
        [
            (v >= c.lower) & (v <= c.upper)
            for v, c in zip(values.T, hypothesis.coefficients, strict=True)
        ],
        axis=0,
    )
    coulomb = (torque[:turnings] - np.einsum("tk,tk->t", across, values)) / square
    gain = alone + np.einsum("tk,tk->t", right, values) / 2
    return np.where(allowed & (coulomb > -1e-9), gain, 0.0)


def _score(table: Table, present: Fit, index: int, choice: Choice) -> Score | None:
    hypothesis = table.hypotheses[index]
    found = fit(table.grams, choice, present.sigma)
    values = found.effects[-1]
    inside = all(
        c.lower <= v <= c.upper for c, v in zip(hypothesis.coefficients, values, strict=True)
    )
    if not inside:
        return None
    return Score(index, hypothesis, found, found.gain_over(present))


def chance_gains(table: Table, now: Fit, draws: list[Array], accepted: int) -> dict[str, Array]:
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
        across[here.unknown] = columns[:, here.local].T @ weighted
        inverse = solve(now.normal, across)
        noise = weighted.T @ draws[j]
        right = noise - inverse[here.unknown].T @ noise[here.local]
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
