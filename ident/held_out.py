"""How well each estimator predicts stretches of the recordings that it was not fitted on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.assessment import Errors, Sums, sums
from ident.estimators import ESTIMATORS
from ident.evidence import FOLDS, Evidence, held_out
from ident.regression import BLOCKS, block_of

Array = NDArray[np.floating]


@dataclass(frozen=True)
class HeldOut:
    """One estimator, fitted three times on two thirds of the stretches and tested on the rest.

    Attributes:
        errors: over all stretches, each predicted without having been seen.
        sd_percent: standard error of the relative error over all joints, by leaving out stretches
            [%].
        predicted: torque of each recording's excerpt [N m], shape (E, n) each.
    """

    errors: Errors
    sd_percent: float
    predicted: tuple[Array, ...]


def check_held_out(evidence: Evidence, names: Sequence[str]) -> dict[str, HeldOut]:
    """Every stretch of every recording is left out once, with every third pair of others."""
    masks = [held_out(fold) for fold in range(FOLDS)]
    training = [evidence.only(~mask) for mask in masks]
    return {
        name: _test(evidence, masks, [ESTIMATORS[name](part).beta for part in training])
        for name in names
    }


def _test(
    evidence: Evidence, masks: Sequence[NDArray[np.bool_]], betas: Sequence[Array]
) -> HeldOut:
    stretches: list[Sums] = []
    for mask, beta in zip(masks, betas, strict=True):
        for b in np.flatnonzero(mask):
            counts = evidence.counts[:, b]
            if counts.any():
                stretches.append(sums(evidence.triangles[:, b], counts, beta))
    total = stretches[0]
    for part in stretches[1:]:
        total = total + part
    return HeldOut(total.errors(), spread(stretches), _predictions(evidence, masks, betas))


def spread(stretches: Sequence[Sums]) -> float:
    """Standard error of the relative error over all joints, by leaving out stretches [%]."""
    residual = np.array([s.residual.sum() for s in stretches])
    torque = np.array([s.torque.sum() for s in stretches])
    without = 100 * np.sqrt((residual.sum() - residual) / (torque.sum() - torque))
    count = len(stretches)
    return float(np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2)))


def _predictions(
    evidence: Evidence, masks: Sequence[NDArray[np.bool_]], betas: Sequence[Array]
) -> tuple[Array, ...]:
    fold_of = np.zeros(BLOCKS, dtype=np.int64)
    for fold, mask in enumerate(masks):
        fold_of[mask] = fold
    predicted = []
    for log in evidence.logs:
        excerpt = log.reduction.excerpt
        fold = fold_of[block_of(excerpt.t, log.reduction.span_s)]
        torque = np.zeros(excerpt.tau.shape)
        for k, beta in enumerate(betas):
            torque[fold == k] = excerpt.W[fold == k] @ beta
        predicted.append(torque)
    return tuple(predicted)
