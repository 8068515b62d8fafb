"""How the held-out error falls, step by step, from the rigid body to the model with all effects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.gap.data.noise_regions import Region
from ident.gap.regression.current_model import HELD_OUT, SEARCHED
from ident.gap.regression.design_matrix import build_design_matrix
from ident.gap.regression.normal_equations import NormalEquations
from ident.gap.regression.weighted_fit import Fit, ModelStructure, fit, predicted_rms
from ident.gap.results.outcome import Search

FRICTION = ("coulomb", "viscous")
"""What every nominal model has beside the rigid body."""


@dataclass(frozen=True)
class Step:
    """A model with one thing more than the one before.

    Attributes:
        added: `rigid_body`, one of `FRICTION`, or an effect's id.
        joints: where, from 0; empty for the whole arm.
        relative_percent: held-out error by least squares while the joints move.
    """

    added: str
    joints: tuple[int, ...]
    relative_percent: float


def steps(found: Search) -> list[Step]:
    """The rigid body, the kind of friction that helps most, the other one, then each effect.

    Empty beside a trusted model, which has its friction already.
    """
    if found.source.trusted is not None:
        return []
    table = build_design_matrix(found.rows, found.end.model, found.end.accepted)
    none = ModelStructure(found.end.model.shapes)
    sizes: dict[tuple[str, ...], float] = {
        kinds: _error(_without(table.grams, kinds), none, found.end.fit)
        for kinds in ((), ("coulomb",), ("viscous",), FRICTION)
    }
    first = min(FRICTION, key=lambda kind: sizes[(kind,)])
    second = next(kind for kind in FRICTION if kind != first)
    told = [
        Step("rigid_body", (), sizes[()]),
        Step(first, (), sizes[(first,)]),
        Step(second, (), sizes[FRICTION]),
    ]
    choice = none
    for i, h in enumerate(found.end.accepted):
        choice = choice.with_slot(table.slots[i])
        told.append(Step(h.effect, h.joints, _error(table.grams, choice, found.end.fit)))
    return told


def _without(grams: NormalEquations, kinds: Sequence[str]) -> NormalEquations:
    """The inner products with only these kinds of friction; other columns are zero."""
    products = []
    for layout, product in zip(grams.layouts, grams.products, strict=True):
        absent: list[int] = [] if "viscous" in kinds else [layout.viscous]
        if "coulomb" not in kinds:
            absent += range(layout.first_turning, layout.first_extra)
        kept = product.copy()
        kept[..., absent, :] = 0.0
        kept[..., :, absent] = 0.0
        products.append(kept)
    return replace(grams, products=tuple(products))


def _error(grams: NormalEquations, choice: ModelStructure, like: Fit) -> float:
    """Residual beside torque on the held-out fold [%], fitted on the others."""
    here = grams.of([HELD_OUT])
    rms = predicted_rms(here, fit(grams.of(SEARCHED), choice, like.sigma))
    moving = np.arange(len(Region)) != Region.REVERSAL
    squares = (rms**2 * here.counts[:, 0])[:, moving].sum()
    torque = sum(p[0][moving, -1, -1].sum() for p in here.products)
    return 100 * float(np.sqrt(squares / max(torque, np.finfo(float).tiny)))
