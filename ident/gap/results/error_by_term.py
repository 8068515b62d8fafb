"""Held-out error with one term more at a time, from the rigid body to all effects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.gap.data.blocks import HELD_OUT, SEARCHED
from ident.gap.data.noise_regions import Region
from ident.gap.regression.model_columns import ModelStructure
from ident.gap.regression.normal_equations import NormalEquations
from ident.gap.regression.weighted_fit import Fit, fit, predicted_rms
from ident.gap.results.outcome import SearchResult

FRICTION = ("coulomb", "viscous")
"""Terms of the nominal model beside the rigid body."""


@dataclass(frozen=True)
class Step:
    """A model with one term more than the one before.

    Attributes:
        added: `rigid_body`, one of `FRICTION`, or an effect's id.
        joints: where, from 0; empty for the whole arm.
        relative_percent: held-out error by least squares while the joints move.
    """

    added: str
    joints: tuple[int, ...]
    relative_percent: float


def error_by_term(found: SearchResult) -> list[Step]:
    """The rigid body, the friction term that helps more, the other one, then each effect.

    Empty with a reference model, which has its friction already.
    """
    if found.source.reference_model is not None:
        return []
    end = found.end
    design = end.design(found.rows)
    structure = ModelStructure(end.model.shapes)
    errors: dict[tuple[str, ...], float] = {
        kinds: _error(_with_only(design.equations, kinds), structure, end.fit)
        for kinds in ((), ("coulomb",), ("viscous",), FRICTION)
    }
    first, second = sorted(FRICTION, key=lambda kind: errors[(kind,)])
    found_steps = [
        Step("rigid_body", (), errors[()]),
        Step(first, (), errors[(first,)]),
        Step(second, (), errors[FRICTION]),
    ]
    for h, index in zip(end.accepted, design.index, strict=True):
        structure = structure.with_effect(index)
        error = _error(design.equations, structure, end.fit)
        found_steps.append(Step(h.effect, h.joints, error))
    return found_steps


def _with_only(equations: NormalEquations, kinds: Sequence[str]) -> NormalEquations:
    """Inner products with these friction terms only; columns of the others are zero."""
    products = []
    for layout, product in zip(equations.layouts, equations.products, strict=True):
        absent: list[int] = [] if "viscous" in kinds else [layout.viscous]
        if "coulomb" not in kinds:
            absent += range(layout.first_reversal, layout.first_effect)
        kept = product.copy()
        kept[..., absent, :] = 0.0
        kept[..., :, absent] = 0.0
        products.append(kept)
    return replace(equations, products=tuple(products))


def _error(equations: NormalEquations, structure: ModelStructure, like: Fit) -> float:
    """Relative error on the held-out fold [%], fitted on the others."""
    here = equations.of([HELD_OUT])
    rms = predicted_rms(here, fit(equations.of(SEARCHED), structure, like.sigma))
    moving = np.arange(len(Region)) != Region.REVERSAL
    squares = (rms**2 * here.counts[:, 0])[:, moving].sum()
    torque = sum(p[0][moving, -1, -1].sum() for p in here.products)
    return 100 * float(np.sqrt(squares / max(torque, np.finfo(float).tiny)))
