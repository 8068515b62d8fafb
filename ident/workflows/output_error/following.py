"""Whether a simulation says more of where the joints are than their commands say."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Grade, Remark, joints, numbers
from ident.report.servos.run_page import ServoTrace
from ident.signals.arrays import Array

_BAD = 0.5  # of the error that following the command at once would have, or standing still
_COUNTS = 3  # errors of so many steps of the encoder are none


def following(traces: Sequence[ServoTrace]) -> Array:
    """Rms distance of positions from commands [rad], shape (n,)."""
    away = np.concatenate([t.commanded - t.measured for t in traces])
    return np.sqrt(np.mean(away**2, axis=0))


def hardly_better(
    rms: Array, traces: Sequence[ServoTrace], resolution: Array, moving: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Joints whose simulation is hardly better than following the command, or standing still.

    Args:
        rms: error of the simulation [rad], shape (n,).
        traces: the recordings.
        resolution: smallest step of the positions [rad], shape (n,).
        moving: the joints that are judged, shape (n,).
    """
    still = np.concatenate([t.measured for t in traces]).std(axis=0)
    limit = np.maximum(_BAD * np.minimum(following(traces), still), _COUNTS * resolution)
    return np.flatnonzero((rms > limit) & moving)


def no_better_remark(places: NDArray[np.intp], names: Sequence[str], where: str) -> Remark:
    """What is said of such joints; `where` tells on which data."""
    text = (
        f"{where} the simulation of {joints(places, names)} is hardly better than following the"
        " command without delay, or than standing still."
    )
    advice = (
        "Check for end stops, contact, and commands that do not belong to the recording or have"
        " another unit, sign, or zero than the positions."
    )
    return Remark("large_error", numbers(places), text, Grade.DOUBTFUL, advice)


def on_any_data(places: NDArray[np.intp], names: Sequence[str]) -> Remark:
    """The same of what was fitted and of what was not."""
    return no_better_remark(places, names, "On held-out segments or along all recordings,")
