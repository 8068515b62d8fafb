"""Two effects on one joint, of which each hides the other: either alone gains too little.

Forward selection takes the best effect first. Where two act on a joint, what the second one leaves
may keep either alone below its threshold, though each clearly gains beside the other. So where no
effect passes alone, pairs are looked for: first with the model projected off their columns (Frisch-
Waugh-Lovell), then, for those that look large enough, with everything fitted again and every test
of a single effect, each beside the other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate
from ident.gap.data.blocks import SEARCHED
from ident.gap.data.noise_regions import Region
from ident.gap.regression.projection import SEEN, joint_rows, projected
from ident.gap.regression.residuals import residuals
from ident.gap.regression.weighted_fit import fit
from ident.gap.selection.acceptance import each_beside_the_other
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.selection.thresholds import Threshold
from ident.gap.settings import GapSettings
from ident.signals.arrays import Array

_TRIED = 3  # pairs that are fitted exactly
_NEAR = 0.7  # of a threshold: the exact gain may be larger by so much
_ROUNDING = 1e-9  # of the residual's square


class _Pair(NamedTuple):
    """Two candidates, and the joint's gain with both [nats per sample]."""

    gain: float
    one: Candidate
    other: Candidate


def masked_pair(
    state: SelectionState, candidates: Sequence[Candidate], settings: GapSettings
) -> list[AcceptedEffect]:
    """The two effects of the best pair that passes, or none.

    Args:
        state: a model beside which no single effect passes.
        candidates: what may be taken.
        settings: of the search.
    """
    taken = {a.place for a in state.accepted}
    free = [h for h in candidates if len(h.rows) == 1 and (h.effect, h.joints) not in taken]
    likely: list[_Pair] = []
    for joint in _by_joint(state, free):
        likely += _likely(joint, state.threshold)
    for pair in sorted(likely, key=lambda p: -p.gain)[:_TRIED]:
        near = [h for h in free if h.rows == pair.one.rows]
        found = each_beside_the_other(state, pair.one, near, settings)
        if found:
            return found
    return []


@dataclass(frozen=True)
class _Joint:
    """Candidates on one joint beside the current model, in units of the noise.

    Attributes:
        effects: the candidates of which the model absorbs no column.
        places: the columns of each.
        products: inner products of all columns, and last of the residual, without what the model
            absorbs, shape (c + 1, c + 1).
        sliding: the same of the rows away from reversals, where friction may be anything.
    """

    effects: list[Candidate]
    places: list[list[int]]
    products: Array
    sliding: Array

    @property
    def whole(self) -> float:
        """Square of the residual away from reversals."""
        return float(self.sliding[-1, -1])

    def fitted(self, *chosen: int) -> tuple[float, Array]:
        """Square of what some of the candidates leave there, and their coefficients."""
        own = [c for k in chosen for c in self.places[k]]
        values = np.linalg.lstsq(self.products[np.ix_(own, own)], self.products[own, -1])[0]
        over = np.append(-values, 1.0)
        rest = over @ self.sliding[np.ix_([*own, -1], [*own, -1])] @ over
        return max(float(rest), _ROUNDING * self.whole), values


def _by_joint(state: SelectionState, candidates: Sequence[Candidate]) -> Iterator[_Joint]:
    """The candidates on each joint that moves."""
    design = state.current.design(state.rows, candidates)
    structure = design.structure(state.current.model.shapes)
    now = fit(design.equations.of(SEARCHED), structure, state.current.fit.sigma)
    chosen, last = np.isin(design.fold, SEARCHED), range(design.accepted, len(design.effects))
    for j, left in enumerate(residuals(design, now)):
        own = [i for i in last if design.effects[i].rows == (j,)]
        if len(left.values) == 0 or not own:
            continue
        rows = joint_rows(design, now, j, chosen, left.values)
        beside = projected(now, rows, np.hstack([design.effect_columns(i, j) for i in own]))
        left_over = np.column_stack([beside.scaled - rows.model @ beside.absorbed, rows.error])
        moving = left_over[design.region[chosen, j] != Region.REVERSAL]
        if not moving[:, -1].any():
            continue
        products = left_over.T @ left_over
        products[:-1, :-1] = beside.products
        products[:-1, -1] = beside.scaled.T @ rows.error
        seen = np.diag(beside.products) > SEEN * (beside.scaled**2).sum(axis=0)
        ends = np.cumsum([design.index[i].width for i in own])
        places = [list(range(e - design.index[i].width, e)) for i, e in zip(own, ends, strict=True)]
        kept = [k for k, place in enumerate(places) if seen[place].all()]
        effects = [design.effects[own[k]] for k in kept]
        yield _Joint(effects, [places[k] for k in kept], products, moving.T @ moving)


def _likely(joint: _Joint, threshold: Threshold) -> list[_Pair]:
    """Of each two effects the forms that explain most, if they seem to hide each other."""
    alone = [joint.fitted(k)[0] for k in range(len(joint.effects))]
    best: dict[tuple[str, str], _Pair] = {}
    for k, one in enumerate(joint.effects):
        for n, other in enumerate(joint.effects[:k]):
            if one.effect == other.effect:
                continue
            rest, values = joint.fitted(k, n)
            gain, known = _gain(joint.whole, rest), best.get((one.effect, other.effect))
            large = all(
                _gain(alone[without], rest) >= _NEAR * threshold.of(h.effect)
                for h, without in ((one, n), (other, k))
            )
            if large and (known is None or gain > known.gain) and _may_be(values, one, other):
                best[one.effect, other.effect] = _Pair(gain, one, other)
    return list(best.values())


def _gain(before: float, after: float) -> float:
    """Gain of a joint whose squares fall [nats per sample]."""
    return float(np.log(before / after) / 2)


def _may_be(values: Array, *effects: Candidate) -> bool:
    """Whether coefficients are such as their effects can have."""
    limits = [c for h in effects for c in h.coefficients]
    return all(c.lower <= x <= c.upper for c, x in zip(limits, values, strict=True))
