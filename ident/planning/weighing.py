"""How well each answer predicted a recording that it had not seen."""

from collections.abc import Sequence

import numpy as np

from ident.effects.compensation import torque_along
from ident.effects.smoothed_segment import SmoothedSegment, smoothed
from ident.gap.data.windows import windows_for
from ident.model.identified_model import Model
from ident.planning.noise import Noise, in_blocks
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError


def stretches(data: Dataset) -> list[SmoothedSegment]:
    """The recording's unbroken stretches, smoothed.

    Raises:
        DataError: none is long enough.
    """
    found = [smoothed(s, data.rate_hz, 0) for s in data.segments]
    long = [s for s in found if s is not None]
    if not long:
        raise DataError(f"{data.name}: too short to say how well an answer predicted it.")
    return long


def log_likelihood(
    model: Model, noise: Noise, data: Dataset, motion: Sequence[SmoothedSegment]
) -> Array:
    """Logarithm of the likelihood of each block and joint [nats], shape (B, n).

    What all answers share is left out.

    Args:
        model: the answer.
        noise: of the prediction, the same for all answers.
        data: the recording.
        motion: its stretches.

    Raises:
        DataError: an effect that is not known.
    """
    windows = windows_for(data.rate_hz, noise.cutoff_hz)
    found = []
    for s in motion:
        left = windows.mean(s.tau - torque_along(model, data, s))
        squares = (left / noise.of_rows(s.speeds[1], windows)) ** 2
        found.append(in_blocks(-squares / 2.0, windows))
    return np.concatenate(found)
