"""An effect put into the simulated arm at many joints at once, fitted, and judged by joint."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Prior, fit
from ident.output_error.missing.folds import Fold
from ident.output_error.missing.judging import block_errors, gain
from ident.output_error.missing.kinds import EffectKind
from ident.output_error.parameters import ROW
from ident.output_error.selection import scanned
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
    began = scanned(fold.fitted, best, kind.part, places, prior)
    loose = best.free | new
    if not new[ROW["zero"]].any():
        loose[ROW["zero"]] = False  # held while others are tried: they take long
    found = fit(fold.fitted, began, loose, prior, rounds)
    found = replace(found, free=best.free | new)
    errors = block_errors(fold.judged, found.settings)
    return Trial(kind, places, found, errors, np.where(places, gain(judged, errors), 0.0))
