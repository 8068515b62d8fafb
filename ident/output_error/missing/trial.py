"""An effect put into the simulated arm at many joints at once, fitted, and judged by joint."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Prior, fit
from ident.output_error.missing.folds import Fold
from ident.output_error.missing.judging import block_errors, gain
from ident.output_error.missing.kinds import EffectKind
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.selection import BASE, rms
from ident.signals.arrays import Array

Places = NDArray[np.bool_]


@dataclass(frozen=True)
class Trial:
    """An effect that was tried.

    Attributes:
        kind: the effect.
        places: joints at which it was, shape (n,).
        fit: with it at all of them.
        errors: of the judging pieces, shape (B, n).
        gain: nats per sample on them, by joint, shape (n,); 0 where it was not.
    """

    kind: EffectKind
    places: Places
    fit: Fit
    errors: Array
    gain: Array


def tried(
    fold: Fold,
    best: Fit,
    judged: Array,
    kind: EffectKind,
    places: Places,
    prior: Prior,
    rounds: int,
) -> Trial:
    """The arm with an effect at some joints.

    Args:
        fold: pieces to fit and to judge.
        best: the arm so far.
        judged: its errors on the judging pieces, shape (B, n).
        kind: the effect.
        places: joints to put it at, shape (n,).
        prior: what is believed.
        rounds: most steps of the fit.
    """
    new = np.zeros_like(best.free)
    new[[ROW[name] for name in kind.part.quantities]] = places
    began = _scanned(fold, best, kind, places, prior)
    loose = best.free | new
    if not new[ROW["zero"]].any():
        loose[ROW["zero"]] = False  # held while others are tried: they take long
    found = fit(fold.fitted, began, loose, prior, rounds)
    found = replace(found, free=best.free | new)
    errors = block_errors(fold.judged, found.settings)
    return Trial(kind, places, found, errors, np.where(places, gain(judged, errors), 0.0))


def _scanned(fold: Fold, best: Fit, kind: EffectKind, places: Places, prior: Prior) -> Array:
    """Each joint where it fits best with the effect at one of a few sizes.

    All else is as in the arm so far, or as in the first guess: settings that were fitted without
    the effect may have gone far to make up for it. What lets a joint lag as friction does is also
    tried with less friction.
    """
    row, q = ROW[kind.part.quantities[0]], QUANTITIES[ROW[kind.part.quantities[0]]]
    dry, stiff, basic = ROW["coulomb"], ROW["stiffness"], [ROW[name] for name in BASE]
    fresh = best.settings.copy()
    fresh[basic] = np.where(best.free[basic], prior.center[basic], fresh[basic])
    began, left = best.settings.copy(), np.full(len(places), np.inf)
    shares = (0.0, 0.5, 1.0) if kind.instead_of_friction else (0.0,)
    for origin, size, share in product((best.settings, fresh), kind.part.sizes, shares):
        unit = origin[ROW[kind.part.relative]] if kind.part.relative else 1.0
        settings = np.where(places, origin, best.settings)
        settings[row] = np.where(places, np.clip(size * unit, q.low, q.high), settings[row])
        less = np.maximum(settings[dry] - share * size * settings[stiff], 0.05 * settings[dry])
        settings[dry] = np.where(places & (share > 0.0), less, settings[dry])
        error = np.log(rms(fold.fitted, settings))
        better = places & (error < left)
        began, left = np.where(better, settings, began), np.where(better, error, left)
    return began
