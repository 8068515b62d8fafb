"""Servos whose gain is not the same in all recordings: two arms, or settings that were changed.

A fit of all of them lies between, and is wrong of each. So each recording is fitted by itself, from
where all of them led; what the model lacks moves a gain as well, on a hobby arm by a quarter.
"""

from dataclasses import dataclass, replace

import numpy as np

from ident.output_error.fit import Fit, fit
from ident.output_error.judging import gain, left_out, of_blocks, sureness
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared, searched
from ident.output_error.search.settings import SearchSettings
from ident.output_error.uncertainty import Knowledge, unknown_factor
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

_SEEN_S = 20.0  # of each recording
_ROUNDS = 4
_APART = np.log(1.6)
_HELPS = 0.3  # nats per sample by which a recording is predicted better by its own gain


@dataclass(frozen=True)
class ChangedGain:
    """A joint's gain in two recordings.

    Attributes:
        joint: from 0.
        less, more: the recordings.
        factor: of the gains.
    """

    joint: int
    less: str
    more: str
    factor: float


def changed_gain(
    begun: Prepared, found: Fit, known: Knowledge, settings: SearchSettings
) -> ChangedGain | None:
    """The joint whose gain differs most between two recordings; None: none does clearly.

    One of the two has to be predicted surely better with a gain of its own. A joint whose torques
    are known only up to a factor knows no gain.

    Args:
        begun: arm and recordings.
        found: the fit of all recordings.
        known: how well that is known.
        settings: numbers that decide.
    """
    names = list(dict.fromkeys(s.name for s in begun.setup.segments))
    if len(names) < 2:
        return None
    own = {name: told for name in names if (told := _by_itself(begun, found, name)) is not None}
    best, weighed = None, ~unknown_factor(known)
    for less, (low, _, _) in own.items():
        for more, (high, _, _) in own.items():
            sure = np.zeros(len(low), dtype=bool)
            for _, helps, how_sure in (own[less], own[more]):
                sure |= (helps > _HELPS) & (how_sure > settings.sure)
            apart = np.where(sure & weighed, high - low, 0.0)
            j = int(np.argmax(apart))
            if apart[j] > (np.log(best.factor) if best else _APART):
                best = ChangedGain(j, less, more, float(np.exp(apart[j])))
    return best


def _by_itself(begun: Prepared, found: Fit, name: str) -> tuple[Array, Array, Array] | None:
    """Logarithm of each joint's gain in one recording, how it helps there, and how surely.

    None where the recording is too short to be predicted from its own parts.
    """
    mine = tuple(s for s in begun.setup.segments if s.name == name)
    try:
        setup = searched(replace(begun.setup, segments=mine), _SEEN_S)
    except DataError:
        return None
    free = found.free.copy()
    free[ROW["zero"]] = False
    before = of_blocks(setup, setup.residuals(found.settings))
    own = fit(setup, found.settings, free, begun.prior, _ROUNDS)
    after = left_out(setup, own, begun.prior)
    row = ROW["stiffness"]
    return np.log(own.settings[row]), gain(before, after), sureness(before, after)
