"""Minimum detectable size of each effect at each joint, and effects that are not observable."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import FOLDS, SEARCHED
from ident.gap.data.rounding import torque_resolution
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.sandwich import block_labels
from ident.gap.results.outcome import SearchResult
from ident.gap.results.smallest_size import model_on
from ident.gap.selection.candidates import all_candidates
from ident.signals.arrays import Array

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
    """Smallest sizes that could have been named beside the model with all effects.

    An effect of that size reaches the gain that is asked for, is as many standard errors from zero
    as a name needs, and is seen beside the torque's resolution and the joint's friction.
    """
    rows, end, settings = found.rows, found.end, found.options.settings
    design = end.design(rows, all_candidates(end.model.facts))
    searched, whole = (model_on(design, end.fit, folds) for folds in (SEARCHED, range(FOLDS)))
    labels = block_labels(rows, design, settings.significance.block_s)
    resolution, facts = torque_resolution(found.source), end.model.facts
    sizes: dict[str, dict[int, list[float]]] = {}
    for i, h in enumerate(design.effects):
        if i < design.accepted:
            continue
        size, gained, sure = np.inf, searched.beside(i), whole.beside(i)
        if gained is not None and sure is not None:
            size = max(
                gained.size_of_gain(found.threshold.of(h.effect)),
                settings.naming.z * sure.standard_error(labels),
                sure.size_of_torque(i, settings.naming, resolution),
                h.coefficients[0].min_size,
            )
            size = size if _is_possible(design, i, size, facts.peak_torque) else np.inf
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


def _is_possible(design: DesignMatrix, index: int, size: float, peak: Array) -> bool:
    """Whether a first coefficient is one that the effect may have, and is no giant's.

    Its torque is usually no larger than a joint's peak.

    Args:
        design: columns of all candidates.
        index: the effect's place among them.
        size: the coefficient.
        peak: peak torque of each joint [N m], shape (n,).
    """
    columns = {j: design.effect_columns(index, j)[:, 0] for j in design.effects[index].rows}
    shares = [np.sqrt(np.mean(c**2)) / max(peak[j], 1e-9) for j, c in columns.items() if len(c) > 0]
    first = design.effects[index].coefficients[0]
    allowed = size <= max(-first.lower, first.upper)
    return allowed and max(shares) >= _NO_TORQUE and size * max(shares) <= 1.0
