"""How well each estimator predicts stretches of the recordings that it was not fitted on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.estimation.least_squares import ESTIMATORS
from ident.estimation.regression_data import FOLDS, RegressionData, held_out
from ident.regression.reduction import BLOCKS, block_of
from ident.regression.squared_errors import Errors, Sums, added, sums
from ident.signals.arrays import Array

FOLD_MASKS = [held_out(fold) for fold in range(FOLDS)]


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


def check_held_out(evidence: RegressionData, names: Sequence[str]) -> dict[str, HeldOut]:
    """Every stretch of every recording is left out once, with every third pair of others."""
    training = [evidence.only(~mask) for mask in FOLD_MASKS]
    return {
        name: predicted_by(evidence, [ESTIMATORS[name](part).beta for part in training])
        for name in names
    }


def held_out_sums(evidence: RegressionData, name: str) -> list[Sums]:
    """Of each stretch that has rows, what an estimator leaves that has not seen it."""
    return _sums(evidence, [ESTIMATORS[name](evidence.only(~mask)).beta for mask in FOLD_MASKS])


def left_out_sums(evidence: RegressionData, name: str) -> list[Sums]:
    """Of each stretch that has rows, what an estimator leaves that has not seen its motion.

    Recordings are left out one by one, or by threes as stretches are; of one recording the thirds
    of its time.
    """
    logs = evidence.logs
    parts: list[tuple[RegressionData, Sequence[int], NDArray[np.bool_]]] = []
    if len(logs) == 1:
        third = np.arange(BLOCKS) * FOLDS // BLOCKS
        parts = [(evidence.only(third != k), [0], third == k) for k in range(FOLDS)]
    for k in range(min(FOLDS, len(logs)) if len(logs) > 1 else 0):
        own = range(k, len(logs), FOLDS)
        rest = tuple(log for i, log in enumerate(logs) if i not in own)
        parts.append((replace(evidence, logs=rest), own, np.ones(BLOCKS, dtype=bool)))
    found: list[Sums] = []
    for seen, own, kept in parts:
        beta = ESTIMATORS[name](seen).beta
        known = np.any(evidence.counts, axis=2) & kept
        places = [(i, b) for i in own for b in np.flatnonzero(known[i])]
        found += [sums(evidence.triangles[at], evidence.counts[at], beta) for at in places]
    return found


def _sums(evidence: RegressionData, betas: Sequence[Array]) -> list[Sums]:
    return [
        sums(evidence.triangles[:, b], evidence.counts[:, b], beta)
        for mask, beta in zip(FOLD_MASKS, betas, strict=True)
        for b in np.flatnonzero(mask)
        if evidence.counts[:, b].any()
    ]


def predicted_by(evidence: RegressionData, betas: Sequence[Array]) -> HeldOut:
    """What base parameters say of the stretches that each of them has not seen, fold by fold."""
    stretches = _sums(evidence, betas)
    return HeldOut(added(stretches).errors(), spread(stretches), _predictions(evidence, betas))


def spread(stretches: Sequence[Sums]) -> float:
    """Standard error of the relative error over all joints, by leaving out stretches [%]."""
    return jackknife(lambda s: s.errors().relative_percent, stretches)[1]


def jackknife(figure: Callable[..., float], *parts: Sequence[Sums]) -> tuple[float, float]:
    """A figure of all stretches, and its standard error by leaving out each in turn.

    Args:
        figure: takes the sum of each of the parts.
        parts: the same stretches, once or more, perhaps of several models.
    """
    totals, count = [added(p) for p in parts], len(parts[0])
    rests = (
        [t - s for t, s in zip(totals, left, strict=True)] for left in zip(*parts, strict=True)
    )
    without = np.array([figure(*rest) for rest in rests])
    spread = np.sum((without - without.mean()) ** 2)
    return figure(*totals), float(np.sqrt((count - 1) / count * spread))


def _predictions(evidence: RegressionData, betas: Sequence[Array]) -> tuple[Array, ...]:
    fold_of = np.zeros(BLOCKS, dtype=np.int64)
    for fold, mask in enumerate(FOLD_MASKS):
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
