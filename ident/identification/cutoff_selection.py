"""The cut-off where the recordings' velocity does not tell it: by the error on unfiltered torque.

The usual cut-off lies ten times above the frequency below which the velocity has its energy. Where
positions are noisy, their differences have it up to half the sampling rate, and that frequency
tells of the noise; where the torque is noisy, the cut-off of a fast motion lets too much of it in.
A filter must not judge itself, since a lower cut-off always leaves less: each one's fit is judged
by the torque as it was before the filter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.least_squares import ESTIMATORS
from ident.estimation.regression_data import reduce_recordings
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.regression.filters import highest_cutoff_hz, wanted_cutoff_hz
from ident.regression.progress import Tell, silent
from ident.regression.squared_errors import sums
from wamctl.arm.errors import DataError

_NOISY = 0.5  # of the highest cut-off: a wanted one beyond it may be noise
_MUCH_PERCENT = 25.0  # of unfiltered torque left at the usual cut-off: lower ones are tried, too
_OCTAVES = 8
_LOWEST_HZ = 1.0
_TIE = 1.03  # times the smallest error: the highest cut-off within it keeps most of the motion


@dataclass(frozen=True)
class CutoffChoice:
    """A cut-off that was chosen.

    Attributes:
        chosen_hz: the cut-off [Hz].
        wanted_hz: what the velocity's spectrum asks for [Hz].
        errors: relative error on unfiltered torque [%], by cut-off [Hz], the highest first.
    """

    chosen_hz: float
    wanted_hz: float
    errors: dict[float, float]

    @property
    def sentence(self) -> str:
        """What was done."""
        first = next(iter(self.errors))
        if first < self.wanted_hz:
            asked = (
                "The velocity's spectrum goes beyond the highest cut-off at this sampling rate,"
                f" {first:.3g} Hz: the motion is fast, or the positions are noisy"
            )
        else:
            asked = (
                "The velocity's spectrum, of the motion or of noise on the positions, asks for a"
                f" cut-off of {self.wanted_hz:.3g} Hz"
            )
        left = f"{self.errors[self.chosen_hz]:.3g} % left"
        if self.chosen_hz != first:
            left += f"; {self.errors[first]:.3g} % at {first:.3g} Hz"
        return (
            f"{asked}. {self.chosen_hz:.3g} Hz was chosen, with which the fit explains the"
            f" unfiltered torque best ({left}); --set cutoff_hz=VALUE takes another."
        )


def with_best_cutoff(
    data: Sequence[Dataset], arm: Arm, tell: Tell = silent
) -> tuple[Arm, CutoffChoice | None]:
    """The arm with a cut-off, where neither its settings nor the recordings' motion give one.

    The choice is None where the cut-off is the one that the motion asks for.

    Args:
        data: the recordings.
        arm: its settings.
        tell: hears what is being done.
    """
    if arm.settings.cutoff_hz is not None or arm.harmonic_hz is not None:
        return arm, None
    wanted = max(wanted_cutoff_hz(d) for d in data)
    highest = min(highest_cutoff_hz(d) for d in data)
    noisy = wanted >= _NOISY * highest
    if not noisy and (_unfiltered_error(data, arm) or 0.0) < _MUCH_PERCENT:
        return arm, None
    start = min(wanted, highest)
    errors: dict[float, float] = {}
    for cutoff in start * 0.5 ** np.arange(_OCTAVES):
        if cutoff < _LOWEST_HZ:
            break
        tell(f"trying a cut-off of {cutoff:.3g} Hz")
        error = _unfiltered_error(data, arm.with_settings(cutoff_hz=float(cutoff)))
        if error is not None:
            errors[float(cutoff)] = error
    if not errors:
        return arm, None
    least = min(errors.values())
    chosen = next(hz for hz, error in errors.items() if error <= _TIE * least)
    if chosen == wanted:
        return arm.with_settings(cutoff_hz=chosen) if noisy else arm, None
    return arm.with_settings(cutoff_hz=chosen), CutoffChoice(chosen, wanted, errors)


def _unfiltered_error(data: Sequence[Dataset], arm: Arm) -> float | None:
    """Relative error on unfiltered torque of a fit to filtered rows [%]; None: no such fit."""
    try:
        evidence = reduce_recordings(data, arm)
        beta = ESTIMATORS["ols"](evidence).beta
    except (DataError, np.linalg.LinAlgError):
        return None
    raw = np.stack([log.reduction.R_raw for log in evidence.logs])
    return sums(raw, evidence.counts.sum(axis=1), beta).errors().relative_percent
