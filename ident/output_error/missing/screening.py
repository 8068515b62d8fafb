"""Where an effect may be worth a fit: what it would explain in first order, cheaply."""

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Setup, columns
from ident.output_error.missing.kinds import EffectKind
from ident.output_error.parameters import QUANTITIES, ROW
from ident.signals.arrays import Array

Places = NDArray[np.bool_]

_TINY = 1e-30


def promising(
    setup: Setup, best: Fit, asked: dict[EffectKind, Places], least: float
) -> dict[EffectKind, Places]:
    """Joints at which an effect could explain something that the arm's other settings cannot.

    Args:
        setup: pieces that are fitted.
        best: the arm so far.
        asked: joints at which each effect is looked for.
        least: nats per sample in first order, below which it is not worth a fit.
    """
    residuals = setup.residuals(best.settings)
    bases = tangents(setup, best)
    left = np.array([r - Q @ (Q.T @ r) for r, Q in zip(residuals.T, bases, strict=True)]).T
    found = {}
    for kind, places in asked.items():
        most = np.zeros(len(places))
        for _, moved in at_sizes(best, kind, places):
            change = setup.residuals(moved) - residuals
            own = np.array([c - Q @ (Q.T @ c) for c, Q in zip(change.T, bases, strict=True)]).T
            helps = np.maximum(-np.sum(left * own, axis=0), 0.0)
            alike = helps**2 / np.maximum((left**2).sum(axis=0) * (own**2).sum(axis=0), _TINY)
            most = np.maximum(most, -0.5 * np.log1p(-np.minimum(alike, 1.0 - 1e-9)))
        found[kind] = places & (most > least)
    return found


def tangents(setup: Setup, best: Fit) -> list[Array]:
    """What the free settings of each joint can do to its positions, orthonormal, (S, p_j) each."""
    made, at = columns(setup, best.settings, best.free), np.argwhere(best.free)
    return [np.linalg.qr(made[at[:, 1] == j, :, j].T)[0] for j in range(best.free.shape[1])]


def at_sizes(best: Fit, kind: EffectKind, places: Places) -> list[tuple[Array, Array]]:
    """The effect at each of its sizes beside what is there: the sizes, and the settings."""
    row, q = ROW[kind.part.quantities[0]], QUANTITIES[ROW[kind.part.quantities[0]]]
    relative = kind.part.relative
    unit = best.settings[ROW[relative]] if relative else np.ones(len(places))
    made = []
    for size in kind.part.sizes:
        moved = best.settings.copy()
        larger = np.clip(moved[row] + size * unit, q.low, q.high)
        moved[row] = np.where(places, larger, moved[row])
        made.append((size * unit, moved))
    return made
