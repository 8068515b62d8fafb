"""Whether recordings of one arm agree: each fitted alone, beside a fit of all the others."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ident.estimation.regression_data import RegressionData
from ident.identification.standard_errors import standard_errors
from ident.regression.triangles import merged, squared_error, squared_torque
from ident.signals.arrays import Array

Change = Literal["friction", "load", "other"]

_EXPLAINED = 0.95
"""Share of the excess squared error that freeing only some parameters must take away."""

_RIDGE = 1e-9


@dataclass(frozen=True)
class Comparison:
    """A recording beside the others.

    Attributes:
        alone: base parameters of its own fit, shape (b,); NaN where its motion leaves them open.
        sd: standard error of each, shape (b,).
        others: base parameters of all other recordings, shape (b,).
        others_sd: standard error of each, shape (b,).
        error: relative error of its own fit on it.
        error_of_others: relative error of the others' parameters on it.
        change: what would explain the difference: friction, a load on the last link, or neither.
    """

    alone: Array
    sd: Array
    others: Array
    others_sd: Array
    error: float
    error_of_others: float
    change: Change

    @property
    def deviations(self) -> Array:
        """Differences in standard errors, shape (b,); zero where one of the two is unknown."""
        with np.errstate(invalid="ignore", divide="ignore"):
            z = (self.alone - self.others) / np.hypot(self.sd, self.others_sd)
        return np.nan_to_num(z, nan=0.0, posinf=0.0, neginf=0.0)


def compared(evidence: RegressionData) -> list[Comparison]:
    """Each recording beside all others; nothing for a single one."""
    count = len(evidence.logs)
    return [_beside(evidence, k) for k in range(count)] if count > 1 else []


def _beside(evidence: RegressionData, k: int) -> Comparison:
    own = _of_logs(evidence, [k])
    rest = _of_logs(evidence, [i for i in range(len(evidence.logs)) if i != k])
    alone, sd = _fit(own)
    others, others_sd = _fit(rest)
    R = merged(own.by_joint)
    torque = float(squared_torque(R))
    least = float(squared_error(R, np.nan_to_num(alone)))
    theirs = float(squared_error(R, np.nan_to_num(others)))
    return Comparison(
        alone,
        sd,
        others,
        others_sd,
        float(np.sqrt(least / torque)),
        float(np.sqrt(theirs / torque)),
        _change(evidence, R, np.nan_to_num(others), theirs, least),
    )


def _of_logs(evidence: RegressionData, chosen: Sequence[int]) -> RegressionData:
    return replace(evidence, logs=tuple(evidence.logs[i] for i in chosen), products=None)


def _fit(evidence: RegressionData) -> tuple[Array, Array]:
    """Least squares and standard errors; NaN and infinite for columns without rows."""
    R = merged(evidence.by_joint)
    seen = np.linalg.norm(R[:, :-1], axis=0) > 0
    beta = np.full(len(seen), np.nan)
    beta[seen] = _solution(R[:, :-1][:, seen], R[:, -1])
    return beta, standard_errors(evidence)


def _solution(W: Array, tau: Array) -> Array:
    scale = np.linalg.norm(W, axis=0)
    return np.linalg.lstsq(W / scale, tau, rcond=_RIDGE)[0] / scale


def _change(
    evidence: RegressionData, R: Array, others: Array, theirs: float, least: float
) -> Change:
    """What has to change beside the others' parameters for the recording to be predicted."""
    base = evidence.base
    friction = [i for i, p in enumerate(base.kept_parameters) if p.kind != "inertial"]
    last = [i for i, p in enumerate(base.parameters) if p.kind == "inertial"][-10:]
    moves: dict[Change, Array] = {
        "friction": np.eye(len(others))[:, friction],
        "load": base.K[:, last],
    }
    left = R @ np.append(-others, 1.0)
    for name, directions in moves.items():
        X = R[:, :-1] @ directions
        X = X[:, np.linalg.norm(X, axis=0) > 0]
        after = float(np.sum((left - X @ _solution(X, left)) ** 2)) if X.size else theirs
        if theirs - after > _EXPLAINED * (theirs - least):
            return name
    return "other"
