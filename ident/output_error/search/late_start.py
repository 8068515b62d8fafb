"""Where the delays of a fit begin.

Late commands and a heavy rotor look alike where a fit begins: both let the joint answer later. A
fit that begins with a short delay gives what a long one leaves to rotor and damping, and stays
there. So longer ones are tried as long as what is left out is predicted better.
"""

from dataclasses import replace

import numpy as np

from ident.output_error.fit import fit
from ident.output_error.judging import gain, left_out, sureness_of_all
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import BASE
from ident.output_error.search.selection import Selection, bare
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import Setup
from ident.signals.arrays import Array

_DELAYS_S = (0.05, 0.08, 0.12, 0.2, 0.3)
_NO_DELAY_S = 2e-3
_EARLIER_S = (0.02, 0.05, 0.1, 0.2)
_CLEARLY = 0.05
"""Nats per sample and joint that earlier commands bring, where an arm answers before them."""


def begun_with_delay(
    begun: Prepared, setup: Setup, settings: SearchSettings
) -> tuple[Prepared, Selection]:
    """The arm with what every joint has, and where its fit began.

    Args:
        begun: arm and recordings.
        setup: what of them is fitted.
        settings: numbers that decide.
    """
    best = begun, bare(setup, begun, settings.fit_rounds)
    row = ROW["delay"]
    for delay in _DELAYS_S:
        later = begun.may[row] & (begun.start[row] < delay)
        if not later.any():
            continue
        start = begun.start.copy()
        start[row, later] = delay
        tried = replace(begun, prior=replace(begun.prior, center=start))
        found = bare(setup, tried, settings.fit_rounds)
        if gain(best[1].errors, found.errors).sum() <= 0.0:
            break
        best = tried, found
    return best


def stamped_late(
    begun: Prepared, base: Selection, found: Selection, settings: SearchSettings
) -> float:
    """How much earlier the commands should have been stamped [s]; 0: not at all.

    A part that the arm has and the model lacks may look the same, so that it has to be so beside
    all parts; or the arm without parts, asked earlier, is better than the one with them.

    Args:
        begun: arm and recordings.
        base: the arm with what every joint has.
        found: the arm with what it was found to have.
        settings: numbers that decide.
    """
    early = answers_early(begun, base, settings)
    beside = answers_early(begun, found, settings) if early else 0.0
    if early == 0.0 or beside:
        return beside
    plain = _fitted_anew(_asked_earlier(found.setup, early), begun, base, settings)
    asked = begun.may[ROW["delay"]]
    sure = sureness_of_all(found.errors[:, asked], plain[:, asked]) > settings.sure
    return early if sure else 0.0


def answers_early(begun: Prepared, found: Selection, settings: SearchSettings) -> float:
    """How much earlier the commands should have been stamped [s]; 0: no delay is below nothing.

    Only asked where no joint shows a delay: commands that are stamped late are then taken to act at
    once.

    Args:
        begun: arm and recordings.
        found: the arm with what it was found to have.
        settings: numbers that decide.
    """
    asked = begun.may[ROW["delay"]]
    if not asked.any() or (found.fit.settings[ROW["delay"], asked] > _NO_DELAY_S).any():
        return 0.0
    best, errors = 0.0, found.errors
    for earlier in _EARLIER_S:
        tried = _fitted_anew(_asked_earlier(found.setup, earlier), begun, found, settings)
        sure = sureness_of_all(found.errors[:, asked], tried[:, asked]) > settings.sure_size
        if not sure or np.mean(gain(errors, tried)[asked]) < _CLEARLY:
            break
        best, errors = earlier, tried
    return best


def _asked_earlier(setup: Setup, earlier_s: float) -> Setup:
    """The recordings with commands that are stamped earlier."""
    moved = (s.motion._replace(stamp=s.motion.stamp - earlier_s) for s in setup.segments)
    pairs = zip(setup.segments, moved, strict=True)
    return replace(setup, segments=tuple(replace(s, motion=m) for s, m in pairs))


def _fitted_anew(
    setup: Setup, begun: Prepared, found: Selection, settings: SearchSettings
) -> Array:
    """Errors of blocks that are left out by the better of two fits, shape (B, n).

    One begins with the arm as it was found, one with the first guess of what every joint has.
    """
    fresh, basic = found.fit.settings.copy(), [ROW[name] for name in BASE]
    fresh[basic] = begun.start[basic]
    made = []
    for start in (found.fit.settings, fresh):
        tried = fit(setup, start, found.fit.free, begun.prior, settings.fit_rounds)
        made.append(left_out(setup, tried, begun.prior))
    return max(made, key=lambda errors: float(gain(found.errors, errors).sum()))
