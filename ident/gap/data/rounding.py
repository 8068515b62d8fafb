"""What is lost where a recording holds torque in steps."""

import numpy as np

from ident.gap.data.experiment import Experiment
from ident.recordings.samples import smallest_step
from ident.signals.arrays import Array

_ARITHMETIC = 1e-6  # of the largest torque: smaller changes are no steps

RMS_OF_LARGEST = 3**-0.5
"""Of the largest rounding error: anything up to that is as likely."""


def torque_resolution(source: Experiment) -> Array:
    """Largest rounding error of each joint's recorded torque [N m], shape (n,): half its step."""
    steps = np.full(source.arm.robot.dof, np.inf)
    for data in source.datasets:
        for segment in data.segments:
            for j, tau in enumerate(np.abs(np.diff(segment.tau, axis=0)).T):
                rounding = _ARITHMETIC * np.abs(segment.tau[:, j]).max()
                steps[j] = min(steps[j], smallest_step(tau, rounding))
    return np.where(np.isfinite(steps), steps / 2, 0.0)
