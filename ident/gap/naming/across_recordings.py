"""What becomes of an effect from recording to recording: leave one recording out.

Stretches of one motion look alike, and an effect that stands in for another cause is confirmed on
all of them. Another motion tells. The spread of an effect's size is the delete-one jackknife over
recordings (Efron, Stein 1981), in which each value counts by what its recording knew: without the
only one that shows an effect, the others may give it any size.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.effects.candidate import Candidate, Value
from ident.gap.data.blocks import EXCLUDED
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import Fit, fit
from ident.gap.selection.cross_validation import effect_energy, gain_of
from ident.gap.selection.estimates import FinalEstimates
from ident.gap.settings import CrossValidation
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Across:
    """One effect across recordings.

    Attributes:
        relative_sd: jackknife standard deviation of each coefficient, relative to it, shape (k,);
            zero where it cannot be told.
        gain: on the recordings that excite it, of the size that the others give it, beside all
            other effects [nats per sample]; None where fewer than two recordings excite it.
    """

    relative_sd: Array
    gain: float | None = None


def across_recordings(
    design: DesignMatrix, rows: WindowedRows, found: Fit, settings: CrossValidation
) -> list[Across]:
    """All effects of a fit on all data, across the recordings."""
    count = int(rows.log.max()) + 1
    unknown = [Across(np.zeros(e.width)) for e in design.index]
    if count < 2 or not unknown:
        return unknown
    log = rows.log
    apart = design.with_folds(np.where(design.fold == EXCLUDED, EXCLUDED, log), count)
    energy = np.array([effect_energy(design, i, found) for i in range(len(unknown))])
    energy[:, design.fold == EXCLUDED] = 0.0
    shares = np.array([[e[log == k].sum() for k in range(count)] for e in energy])
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1e-300)
    exciting = shares > settings.min_energy_share
    left_out = [_without(apart, found, k, count) for k in range(count)]
    across = []
    for i, nothing in enumerate(unknown):
        logs = np.flatnonzero(exciting[i]).tolist()
        if len(logs) < 2:
            across.append(nothing)
            continue
        parts = {k: left_out[k] for k in logs}
        spread = relative_spread([*parts.values()], found, i, settings.min_energy_share)
        across.append(Across(spread, _gain(apart, parts, found, i)))
    return across


def _without(apart: DesignMatrix, found: Fit, log: int, count: int) -> Fit:
    """The fit to all recordings but one."""
    rest = apart.equations.of([k for k in range(count) if k != log])
    return fit(rest, found.structure, found.sigma)


def relative_spread(left_out: Sequence[Fit], found: Fit, index: int, least: float) -> Array:
    """Jackknife standard deviation of an effect's coefficients, relative to them, shape (k,).

    What a value moves by without a recording has, if all recordings agree, the variance by which it
    is known worse then (Hausman 1978). Of recordings that know alike this is the plain jackknife.

    Args:
        left_out: fits without one recording each.
        found: the fit to all of them.
        index: of the effect.
        least: share of what is known that each of these recordings holds at least.
    """
    value, known = found.effects[index], found.effect_variances[index]
    moved = np.array([f.effects[index] - value for f in left_out])
    worse = np.array([f.effect_variances[index] for f in left_out]) / known - 1.0
    spread = np.sqrt((moved**2 / np.maximum(worse, least)).mean(axis=0))
    return spread / np.maximum(np.abs(value), 1e-300)


def _gain(apart: DesignMatrix, left_out: Mapping[int, Fit], found: Fit, index: int) -> float:
    """Mean gain on recordings, of an effect of the size that the others give it.

    Each counts by what the others know of the effect.
    """
    others = tuple(e for i, e in enumerate(found.structure.effects) if i != index)
    structure = replace(found.structure, effects=others)
    without = fit(apart.equations.of(range(apart.folds)), structure, found.sigma)
    known = found.effect_variances[index]
    gains, weights = [], []
    for k, rest in left_out.items():
        gains.append(gain_of(rest.effects[index], apart, index, k, without, found))
        weights.append(float((known / rest.effect_variances[index]).min()))
    return float(np.average(gains, weights=weights))


def spread_over_recordings(
    rows: WindowedRows, end: CurrentFit, final: FinalEstimates, settings: CrossValidation
) -> FinalEstimates:
    """Final estimates with standard deviations that span the recordings."""
    design = replace(end, accepted=final.effects).design(rows)
    across = across_recordings(design, rows, final.fit, settings)
    each = zip(final.effects, final.parameters, across, strict=True)
    return replace(final, parameters=tuple(with_spread(h, v, a) for h, v, a in each))


def with_spread(h: Candidate, values: Mapping[str, Value], across: Across) -> dict[str, Value]:
    """An effect's values, with standard deviations that span the recordings."""
    wider = dict(values)
    for c, share in zip(h.coefficients, across.relative_sd, strict=True):
        if c.name in wider:
            v = wider[c.name]
            wider[c.name] = replace(v, sd=max(v.sd, float(share) * abs(v.value)))
    return wider
