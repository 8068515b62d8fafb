"""Minimum detectable size of each effect at each joint, and effects that are not observable."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import SEARCHED
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.model_columns import joint_columns
from ident.gap.regression.projection import project_off
from ident.gap.regression.weighted_fit import Fit, fit
from ident.gap.results.outcome import SearchResult
from ident.gap.selection.candidates import all_candidates
from ident.signals.arrays import Array

_ABSORBED = 1e-5  # of a column's squares: with less left of it, other parameters stand for it
_MOST_GAIN = 300.0  # nats: more overflows
_NO_TORQUE = 1e-6  # of a joint's peak torque, per unit: rounding


@dataclass(frozen=True)
class MinimumDetectable:
    """Smallest detectable sizes, and unobservable effects.

    Attributes:
        sizes: smallest first coefficient [its SI unit], by effect and joint (from 0).
        unobservable: joints (from 0) at which this motion does not show an effect, by effect; empty
            where it shows on no joint.
        unsearched: effects for which the arm's file does not say enough.
    """

    sizes: dict[str, dict[int, float]]
    unobservable: dict[str, tuple[int, ...]]
    unsearched: tuple[str, ...]


def minimum_detectable(found: SearchResult) -> MinimumDetectable:
    """Smallest sizes that would have been found beside the model with all effects."""
    facts, end = found.end.model.facts, found.end
    searched = end.design(found.rows, all_candidates(facts)).of(SEARCHED)
    now = fit(searched.equations, end.fit.structure, end.fit.sigma)
    weighted = [
        np.tensordot(1 / sigma**2, products[0], axes=1)
        for sigma, products in zip(now.sigma, searched.equations.products, strict=True)
    ]
    sizes: dict[str, dict[int, list[float]]] = {}
    for i, h in enumerate(searched.effects):
        if i < searched.accepted:
            continue
        left, raw = _projected(searched, now, weighted, i)
        size = _smallest(searched, i, left, raw, found.threshold.of(h.effect), facts.peak_torque)
        for j in h.joints or h.rows:
            sizes.setdefault(h.effect, {}).setdefault(j, []).append(size)
    medians = {e: {j: float(np.median(s)) for j, s in by.items()} for e, by in sizes.items()}
    seen = {e: {j: s for j, s in by.items() if np.isfinite(s)} for e, by in medians.items()}
    unobservable = _unobservable(set(sizes), seen, end.accepted, facts.dof)
    unsearched = tuple(n for n, e in catalogue().items() if e.asks_of_arm and n not in sizes)
    return MinimumDetectable({e: by for e, by in seen.items() if by}, unobservable, unsearched)


def _unobservable(
    searched: set[str],
    seen: dict[str, dict[int, float]],
    accepted: Sequence[Candidate],
    dof: int,
) -> dict[str, tuple[int, ...]]:
    """Joints at which an effect does not show; what is in the model has shown itself."""
    shown: dict[str, set[int]] = {}
    for h in accepted:
        shown.setdefault(h.effect, set()).update(h.joints or h.rows)
    found: dict[str, tuple[int, ...]] = {}
    for name, effect in catalogue().items():
        if not effect.needs_reference_model and name not in searched:
            continue  # it has no place on this arm, as a ripple where motors are unknown
        there = {*seen.get(name, {}), *shown.get(name, ())}
        missing = tuple(j for j in range(dof) if j not in there)
        if len(missing) == dof:
            found[name] = ()
        elif missing and not effect.acts_on_pairs:
            found[name] = missing
    return found


def _smallest(
    design: DesignMatrix, index: int, left: Array, raw: Array, gain: float, peak: Array
) -> float:
    """First coefficient at which an effect reaches its threshold; infinite if it never does.

    Args:
        design: columns of all candidates.
        index: the effect's place among them.
        left: weighted products (k, k) of its columns with the model projected off.
        raw: the same before the projection.
        gain: threshold of the effect [nats].
        peak: peak torque of each joint [N m].
    """
    if (np.diag(left) <= _ABSORBED * np.diag(raw)).any():
        return np.inf
    h = design.effects[index]
    rows = float(max(design.equations.counts[list(h.rows)].sum(axis=(1, 2)).max(), 1))
    kept = first_alone(left)
    if kept <= _ABSORBED * raw[0, 0]:
        return np.inf
    size = float(np.sqrt(max((np.exp(2 * min(gain, _MOST_GAIN)) - 1) * rows / kept, 0.0)))
    torque = [np.sqrt(_first_square(design, index, j) / rows) / max(peak[j], 1e-9) for j in h.rows]
    never = max(torque) < _NO_TORQUE or size * max(torque) > 1.0
    return np.inf if never else max(size, h.coefficients[0].min_size)


def first_alone(products: Array) -> float:
    """Square of the first column without what the others explain of it.

    Args:
        products: of k columns, shape (k, k); held joints leave some of them alike.
    """
    others = np.linalg.lstsq(products[1:, 1:], products[1:, 0])[0]
    return float(products[0, 0] - products[0, 1:] @ others)


def _first_square(design: DesignMatrix, index: int, joint: int) -> float:
    """Sum of squares of an effect's first column on a joint."""
    at = design.places(index, joint).start
    return float(design.equations.products[joint][0, :, at, at].sum())


def _projected(
    design: DesignMatrix, now: Fit, weighted: list[Array], index: int
) -> tuple[Array, Array]:
    """Weighted products of an effect's columns, shape (k, k): model projected off, and raw."""
    effect = design.index[index]
    model = joint_columns(design.equations, now.structure)
    raw = np.zeros((effect.width, effect.width))
    across = np.zeros((len(now.normal), effect.width))
    for j in effect.joints:
        own = np.arange(len(weighted[j]))[design.places(index, j)]
        raw += weighted[j][np.ix_(own, own)]
        across[model[j].unknown] += model[j].across(weighted[j], own)
    return project_off(now.normal, across, raw)[0], raw
