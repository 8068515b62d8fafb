"""How well each answer predicted a recording that it had not seen."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.identification.validation import arm_of, predict
from ident.model.identified_model import Model
from ident.planning.choice import BLOCK_S
from ident.recordings.dataset import Dataset
from ident.regression.squared_errors import sums
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Weighed:
    """A recording against all answers.

    Attributes:
        squares: squared residuals [N^2 m^2] in blocks of time, shape (B, n), by answer.
    """

    squares: Mapping[str, Array]


def weigh(models: Mapping[str, Model], data: Dataset) -> Weighed:
    """Squared residuals of each answer's prediction, in blocks that count as independent.

    Args:
        models: the answers, by name.
        data: the recording.

    Raises:
        DataError: the recording moves joints that the models have not seen moving.
    """
    return Weighed({name: _squares(model, data) for name, model in models.items()})


def _squares(model: Model, data: Dataset) -> Array:
    found = predict(model, arm_of(model), data)
    log = found.evidence.logs[0]
    reduced, beta = log.reduction, found.betas[model.estimator]
    seconds = log.data.samples / log.data.rate_hz / len(reduced.R)
    together = max(1, int(np.ceil(BLOCK_S / seconds)))
    first = range(0, len(reduced.R) - together + 1, together)
    parts = [slice(k, k + together) for k in first]
    return np.array([sums(reduced.R[p], reduced.count[p], beta).residual for p in parts])
