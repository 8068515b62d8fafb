"""Curves of the pages: measured torque beside what a model predicts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.estimation.regression_data import ReducedRecording
from ident.identification.identify import Identification
from ident.identification.validation import Prediction
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Trace:
    """One recording.

    Attributes:
        name: of the log.
        t: time [s], shape (E,).
        measured, predicted: torque of all joints [N m], or force [N], shape (E, n) each.
        counted: samples that the errors count, shape (E, n); the others were culled.
    """

    name: str
    t: Array
    measured: Array
    predicted: Array
    counted: NDArray[np.bool_]


def held_out_traces(found: Identification) -> tuple[Trace, ...]:
    """The recordings of the fit, each stretch predicted by a fit that has not seen it."""
    predicted = found.held_out[found.chosen].predicted
    return tuple(_trace(log, p) for log, p in zip(found.evidence.logs, predicted, strict=True))


def validation_trace(prediction: Prediction, estimator: str) -> Trace:
    """A recording that the model was not fitted on."""
    log = prediction.evidence.logs[0]
    return _trace(log, log.reduction.excerpt.W @ prediction.betas[estimator])


def _trace(log: ReducedRecording, predicted: Array) -> Trace:
    excerpt = log.reduction.excerpt
    return Trace(log.data.name, excerpt.t, excerpt.tau, predicted, excerpt.kept)
