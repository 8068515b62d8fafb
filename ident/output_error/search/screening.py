"""Where a part may be worth a fit: what it would explain in first order, cheaply."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.search.parts import Part
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import Setup
from ident.output_error.slopes import columns
from ident.signals.arrays import Array

Places = NDArray[np.bool_]

_TINY = 1e-30


def promising(
    setup: Setup, best: Fit, asked: dict[Part, Places], settings: SearchSettings,
    *, same_servo: bool = False,
) -> dict[Part, Places]:  # fmt: skip
    """Joints at which a part could explain something that the arm's other settings cannot.

    Of a joint that is off by more than a step of its encoder the first order tells too little: what
    its servo may have by itself is worth a fit there. What all gears may have is worth one at every
    joint if they together would gain what one joint has to.

    Args:
        setup: arm and recordings.
        best: the arm so far.
        asked: joints at which each part is looked for.
        settings: gain in first order below which a part is not worth a fit, and the share of what
            the best part would bring at the joint; a servo's own parts move it too far for the
            first order to say which of them is best.
        same_servo: whether joints have a common part all or none, and the same gears.
    """
    least, share = settings.least_gain, settings.screen_share
    hopes = {
        p: _of_half(h, asked[p], alike=same_servo) if p.common else h
        for p, h in _hopes(setup, best, asked)
    }
    most = np.max([np.zeros(best.free.shape[1]), *hopes.values()], axis=0)
    found = {}
    for part, places in asked.items():
        needed = np.maximum(least, 0.0 if part.servo else share * most)
        found[part] = places & ((hopes[part] > needed) | (not part.sizes))
        if part.gears and same_servo and hopes[part].sum() > max(least, share * most.sum()):
            found[part] = places
        if part.servo and not part.common:
            found[part] |= places & (best.rms > setup.resolution)
    return found


def _of_half(gain: Array, places: Places, *, alike: bool) -> Array:
    """What half of the places have: each no more than it, or all alike."""
    if not places.any():
        return gain
    usual = np.median(gain[places])
    return np.where(places, usual, 0.0) if alike else np.minimum(gain, usual)


def _hopes(setup: Setup, best: Fit, asked: dict[Part, Places]) -> Iterator[tuple[Part, Array]]:
    """What each part explains in first order at the best of its sizes, by joint, shape (n,)."""
    residuals = setup.residuals(best.settings)
    bases = tangents(setup, best)
    left = _beyond(residuals, bases)
    for part, places in asked.items():
        most = np.zeros(len(places))
        for moved in setup.residuals_of([moved for _, moved in at_sizes(best, part, places)]):
            own = _beyond(moved - residuals, bases)
            helps = np.maximum(-np.sum(left * own, axis=0), 0.0)
            alike = helps**2 / np.maximum((left**2).sum(axis=0) * (own**2).sum(axis=0), _TINY)
            most = np.maximum(most, -0.5 * np.log1p(-np.minimum(alike, 1.0 - 1e-9)))
        yield part, most * places


def _beyond(changes: Array, bases: Sequence[Array]) -> Array:
    """What each joint's own settings can't do of changes, shape (S, n)."""
    return np.array([c - Q @ (Q.T @ c) for c, Q in zip(changes.T, bases, strict=True)]).T


def tangents(setup: Setup, best: Fit) -> list[Array]:
    """What the free settings of each joint can do to its positions, orthonormal, (S, p_j) each."""
    made, at = columns(setup, best.settings, best.free), np.argwhere(best.free)
    return [np.linalg.qr(made[at[:, 1] == j, :, j].T)[0] for j in range(best.free.shape[1])]


def at_sizes(best: Fit, part: Part, places: Places) -> list[tuple[Array, Array]]:
    """The part at each of its sizes beside what is there, or instead of a limit; and the sizes."""
    row, q = ROW[part.quantities[0]], QUANTITIES[ROW[part.quantities[0]]]
    relative = part.relative
    unit = best.settings[ROW[relative]] if relative else np.ones(len(places))
    made = []
    for size in part.sizes:
        moved = best.settings.copy()
        larger = np.clip(size * unit + (moved[row] if q.scale else 0.0), q.low, q.high)
        moved[row] = np.where(places, larger, moved[row])
        made.append((size * unit, moved))
    return made
