"""The smallest effects that recordings would have shown."""

import numpy as np
from numpy.typing import NDArray

from ident.output_error.first_guess import smoothed
from ident.output_error.judging import typical
from ident.output_error.missing.search import Search
from ident.output_error.parameters import ROW
from ident.output_error.search.parts import Part
from ident.output_error.search.screening import at_sizes, tangents
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import Setup
from ident.signals.arrays import Array

_RARE = 0.005
"""Share of samples below which the load counts as never on the other side."""


def held_by_weight(setup: Setup, settings: Array) -> NDArray[np.bool_]:
    """Joints whose links' weight and motion keep their gears on one flank, shape (n,).

    They do not cross their play, whatever its size; recorded positions then cannot show it. The
    load has to be more than dry friction, all of which may rub at the link and hold it anywhere.
    """
    zero = settings[ROW["zero"]]
    load = np.concatenate([smoothed(setup, s, zero)[3] for s in setup.segments])
    one_way = np.minimum((load > 0.0).mean(axis=0), (load < 0.0).mean(axis=0)) < _RARE
    return one_way & (np.median(np.abs(load), axis=0) > settings[ROW["coulomb"]])


def smallest(found: Search, settings: SearchSettings) -> dict[Part, Array]:
    """Size of each effect that could be named, by joint; NaN where none could, shape (n,).

    What the arm's other settings can take of an effect is taken, in first order; what remains
    counts against the noise floor, or against what is left where that is more.
    """
    beside = np.maximum(found.nulls.floor, typical(found.end.errors))
    setup, end = found.end.setup, found.end.fit
    residuals = setup.residuals(end.settings)
    bases = tangents(setup, end)
    sizes = {}
    for part, places in found.asked.items():
        need = beside**2 * np.expm1(2.0 * found.least(part, settings))
        need = np.maximum(need, settings.seen**2 * setup.resolution**2 / 12.0)
        tried, shown = [], []
        for size, moved in at_sizes(end, part, places):
            if (size > 0.0).all():
                change = setup.residuals(moved) - residuals
                left = [c - Q @ (Q.T @ c) for c, Q in zip(change.T, bases, strict=True)]
                tried.append(size)
                shown.append([np.mean(x**2) for x in left])
        seen = zip(np.array(tried).T, np.array(shown).T, need, strict=True)
        sizes[part] = np.array(
            [_crossing(*s) if here else np.nan for s, here in zip(seen, places, strict=True)]
        )
    return sizes


def _crossing(size: Array, shown: Array, need: float) -> float:
    """Where what is shown reaches what is needed; NaN where the largest size does not."""
    shown = np.maximum.accumulate(np.maximum(shown, 1e-300))
    if shown[-1] < need:
        return float("nan")
    k = int(np.searchsorted(shown, need))
    if k == 0:  # small effects show as their square
        return float(size[0] * np.sqrt(need / shown[0]))
    part = np.log(need / shown[k - 1]) / np.log(shown[k] / shown[k - 1])
    return float(size[k - 1] * (size[k] / size[k - 1]) ** part)
