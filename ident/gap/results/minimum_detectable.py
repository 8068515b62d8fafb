"""What would have been seen: the smallest size of each effect at each joint, and what never."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.regression.current_model import SEARCHED, all_hypotheses
from ident.gap.regression.design_matrix import Table, build_design_matrix
from ident.gap.regression.weighted_fit import Fit, fit, places, solve
from ident.gap.results.outcome import Search

Array = NDArray[np.floating]

_ABSORBED = 1e-5  # of a column's squares: with less left of it, other parameters stand for it

_MOST_GAIN = 300.0  # nats: more overflows
_NO_TORQUE = 1e-6  # of a joint's peak torque, per unit: rounding


@dataclass(frozen=True)
class MinimumDetectable:
    """How small each effect may be, and which cannot be seen.

    Attributes:
        sizes: smallest first coefficient [its SI unit], by effect and joint (from 0).
        unseen: joints (from 0) at which this motion does not show an effect, by effect; none where
            it shows nowhere.
    """

    sizes: dict[str, dict[int, float]]
    unseen: dict[str, tuple[int, ...]]


def minimum_detectable(found: Search) -> MinimumDetectable:
    """Smallest sizes beside the model with all effects."""
    facts = found.end.model.facts
    hypotheses = all_hypotheses(facts)
    table = build_design_matrix(found.rows, found.end.model, found.end.accepted, hypotheses)
    searched = table.searched(SEARCHED)
    now = fit(searched.grams, found.end.fit.choice, found.end.fit.sigma)
    sizes: dict[str, dict[int, list[float]]] = {}
    for i, h in enumerate(hypotheses, len(found.end.accepted)):
        size = _smallest(searched, now, i, h, found.threshold.of(h.effect), facts.peak_torque)
        for j in h.joints or h.rows:
            sizes.setdefault(h.effect, {}).setdefault(j, []).append(size)
    medians = {e: {j: float(np.median(s)) for j, s in by.items()} for e, by in sizes.items()}
    seen = {e: {j: s for j, s in by.items() if np.isfinite(s)} for e, by in medians.items()}
    return MinimumDetectable({e: by for e, by in seen.items() if by}, _unseen(found, seen))


def _unseen(found: Search, seen: dict[str, dict[int, float]]) -> dict[str, tuple[int, ...]]:
    dof = found.end.model.facts.dof
    searched = {h.effect for h in all_hypotheses(found.end.model.facts)}
    unseen: dict[str, tuple[int, ...]] = {}
    for name, effect in catalogue().items():
        if not effect.needs_reference_model and name not in searched:
            continue  # it has no place on this arm, as a ripple where motors are unknown
        missing = tuple(j for j in range(dof) if j not in seen.get(name, {}))
        if len(missing) == dof:
            unseen[name] = ()
        elif missing and not effect.acts_on_pairs:
            unseen[name] = missing
    return unseen


def _smallest(table: Table, now: Fit, index: int, h: Candidate, gain: float, peak: Array) -> float:
    """First coefficient at which the effect gains as much as is asked of it; infinite if never."""
    left, raw = _projected(table, now, index)
    if (np.diag(left) <= _ABSORBED * np.diag(raw)).any():
        return np.inf
    rows = float(max(table.grams.counts[list(h.rows)].sum(axis=(1, 2)).max(), 1))
    kept = 1 / np.linalg.inv(left)[0, 0]
    size = float(np.sqrt(max((np.exp(2 * min(gain, _MOST_GAIN)) - 1) * rows / kept, 0.0)))
    torque = [
        np.sqrt(_raw_square(table, index, row) / rows) / max(peak[j], 1e-9)
        for row, j in enumerate(h.rows)
    ]
    never = max(torque) < _NO_TORQUE or size * max(torque) > 1.0
    return np.inf if never else max(size, h.coefficients[0].min_size)


def _raw_square(table: Table, index: int, row: int) -> float:
    slot = table.slots[index]
    j = slot.joints[row]
    at = table.grams.layouts[j].first_extra + slot.starts[row]
    return float(table.grams.products[j][0, :, at, at].sum())


def _projected(table: Table, now: Fit, index: int) -> tuple[Array, Array]:
    """Weighted products of a hypothesis' columns, shape (k, k): model projected off, and raw."""
    slot = table.slots[index]
    chosen = places(table.grams, now.choice)
    raw = np.zeros((slot.width, slot.width))
    across = np.zeros((len(now.normal), slot.width))
    for j, start in zip(slot.joints, slot.starts, strict=True):
        weighted = np.tensordot(1 / now.sigma[j] ** 2, table.grams.products[j][0], axes=1)
        own = table.grams.layouts[j].first_extra + start + np.arange(slot.width)
        raw += weighted[np.ix_(own, own)]
        across[chosen[j].unknown] += chosen[j].across(weighted, own)
    return raw - across.T @ solve(now.normal, across), raw
