"""Significance: is a coefficient of each effect surely not zero (a Wald test)?"""

from collections.abc import Sequence

import numpy as np

from ident.effects.candidate import Candidate, Value
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.rows import WindowedRows
from ident.gap.selection.estimates import estimates_with_fixed_parameters, final_estimates
from ident.gap.settings import Significance

_TINY = np.finfo(float).tiny


def significant(
    rows: WindowedRows, current: CurrentFit, count: int, settings: Significance
) -> list[bool]:
    """Whether each of the last effects of a model is significant.

    Where an effect has defining coefficients, one of these must be. A coefficient that is uncertain
    only because of a nonlinear parameter (the size of a drift whose end is not recorded) may be
    judged with that parameter held, by a stricter bound.

    Args:
        rows: the rows.
        current: the model.
        count: number of effects to judge.
        settings: of the test.
    """
    estimates = final_estimates(rows, current, settings).parameters
    ratios = _z_scores(current.accepted, estimates)[-count:]
    if min(ratios) > settings.z:
        return [True] * count
    fixed = estimates_with_fixed_parameters(rows, current, settings)
    held = _z_scores(current.accepted, fixed)[-count:]
    return [
        z > settings.z or z_fixed > settings.z_fixed_settings
        for z, z_fixed in zip(ratios, held, strict=True)
    ]


def has_defining_coefficient(h: Candidate) -> bool:
    """Whether the effect would be another one without some of its coefficients."""
    return any(c.defining for c in h.coefficients)


def _z_scores(effects: Sequence[Candidate], parameters: Sequence[dict[str, Value]]) -> list[float]:
    """Largest ratio of a defining coefficient to its standard error, of each effect."""
    found = []
    for h, values in zip(effects, parameters, strict=True):
        defining = [c.name for c in h.coefficients if c.defining]
        names = defining or [c.name for c in h.coefficients]
        sizes = [values[n] for n in names if n in values]
        found.append(max((abs(v.value) / max(v.sd, _TINY) for v in sizes), default=0.0))
    return found
