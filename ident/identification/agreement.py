"""Whether recordings of one arm agree: each fitted alone, beside a fit of all the others."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ident.estimation.regression_data import RegressionData
from ident.identification.standard_errors import standard_errors
from ident.regression.triangles import merged, squared_torque
from ident.signals.arrays import Array

Change = Literal["friction", "load", "other"]

_EXPLAINED = 0.95
"""Share of the excess squared error that freeing only some parameters must take away."""

_OPEN = 1e-4
"""Part of the largest singular value below which a direction of the parameters is open."""

_ITS_OWN = 1e-3
"""Part of a parameter in open directions from which it is not known itself."""

_LEAST_GROUP = 2
_RIDGE = 1e-9


@dataclass(frozen=True)
class Comparison:
    """A recording, or some of them, beside the others.

    Attributes:
        alone: base parameters of its own fit, shape (b,); NaN where its motion leaves them open.
        sd: standard error of each, shape (b,).
        others: base parameters of all other recordings, shape (b,).
        others_sd: standard error of each, shape (b,).
        error: relative error of its own fit on it.
        error_of_others: relative error of the others' parameters on it.
        error_among_others: relative error of the others' fit on themselves.
        change: what would explain the difference: friction, a load on the last link, or neither.
    """

    alone: Array
    sd: Array
    others: Array
    others_sd: Array
    error: float
    error_of_others: float
    error_among_others: float
    change: Change

    @property
    def deviations(self) -> Array:
        """Differences in standard errors, shape (b,); zero where one of the two is unknown."""
        with np.errstate(invalid="ignore", divide="ignore"):
            z = (self.alone - self.others) / np.hypot(self.sd, self.others_sd)
        return np.nan_to_num(z, nan=0.0, posinf=0.0, neginf=0.0)


@dataclass(frozen=True)
class _Fit:
    """Least squares of some recordings.

    Attributes:
        beta: base parameters, shape (b,); zero along what is open.
        sd: standard error of each, shape (b,); infinite where the motion leaves it open.
        open: directions of the parameters along which nothing is told, shape (b, m).
    """

    beta: Array
    sd: Array
    open: Array

    @property
    def told(self) -> Array:
        """The parameters that are known, shape (b,); NaN for the others."""
        return np.where(np.isfinite(self.sd), self.beta, np.nan)


def compared(evidence: RegressionData) -> list[Comparison]:
    """Each recording beside all others; nothing for a single one."""
    count = len(evidence.logs)
    return [beside_others(evidence, [k]) for k in range(count)] if count > 1 else []


def groups(evidence: RegressionData, ratio: float) -> list[list[int]]:
    """Recordings that go together, of two and more, and not with all the others.

    Those go together that the parameters of one of them predict nearly as well as their own. Where
    half of the recordings are of another arm, none stands out beside all others.

    Args:
        evidence: the recordings.
        ratio: of the errors, from which a recording does not go with another.
    """
    count = len(evidence.logs)
    if count < 2 * _LEAST_GROUP:
        return []
    scale = _scale(evidence)
    each = [_of_logs(evidence, [k]) for k in range(count)]
    fits, rows = [_fit(one, scale) for one in each], [merged(one.by_joint) for one in each]
    none = np.zeros((len(scale), 0))
    own = [_squares(R, fit, none) for R, fit in zip(rows, fits, strict=True)]
    found: list[list[int]] = []
    for fit in fits:
        left = [_squares(R, fit, none) for R in rows]
        together = [k for k in range(count) if left[k] < ratio**2 * own[k]]
        if _LEAST_GROUP <= len(together) <= count - _LEAST_GROUP and together not in found:
            found.append(together)
    return found


def _scale(evidence: RegressionData) -> Array:
    """Length of each parameter's column in all recordings, shape (b,)."""
    scale = np.linalg.norm(merged(evidence.by_joint)[:, :-1], axis=0)
    return np.where(scale > 0.0, scale, 1.0)  # what no recording shows is open, whatever its scale


def _squares(R: Array, found: _Fit, free: Array) -> float:
    """Squared error of a fit on rows [N^2 m^2], with what it leaves open fitted to them.

    Args:
        R: triangle of rows and torque, shape (b + 1, b + 1).
        found: the fit.
        free: further directions that are fitted, shape (b, m).
    """
    left, X = R[:, -1] - R[:, :-1] @ found.beta, R[:, :-1] @ np.column_stack([found.open, free])
    X = X[:, np.linalg.norm(X, axis=0) > 0]
    return float(np.sum((left - X @ _solution(X, left)) ** 2)) if X.size else float(left @ left)


def beside_others(evidence: RegressionData, chosen: Sequence[int]) -> Comparison:
    """Some recordings, fitted together, beside all others."""
    scale = _scale(evidence)
    own = _of_logs(evidence, chosen)
    alone = _fit(own, scale)
    rest = _of_logs(evidence, [i for i in range(len(evidence.logs)) if i not in chosen])
    others = _fit(rest, scale)
    R = merged(own.by_joint)
    W, tau = R[:, :-1], R[:, -1]
    least = float(np.sum((tau - W @ alone.beta) ** 2))

    def theirs(free: Array) -> float:
        """Squared error with the others' parameters, open and free ones fitted."""
        return _squares(R, others, free)

    as_they_are = theirs(np.zeros((len(scale), 0)))
    torque = float(squared_torque(R)) or float(squared_torque(merged(rest.by_joint))) or 1.0
    return Comparison(
        alone.told,
        alone.sd,
        others.told,
        others.sd,
        float(np.sqrt(least / torque)),
        float(np.sqrt(as_they_are / torque)),
        _own_error(rest, others),
        _change(evidence, theirs, as_they_are, least),
    )


def _of_logs(evidence: RegressionData, chosen: Sequence[int]) -> RegressionData:
    return replace(evidence, logs=tuple(evidence.logs[i] for i in chosen), products=None)


def _fit(evidence: RegressionData, scale: Array) -> _Fit:
    """Least squares and standard errors.

    Args:
        evidence: the recordings.
        scale: length of each parameter's column in all recordings, shape (b,).
    """
    R = merged(evidence.by_joint)
    U, lengths, axes = np.linalg.svd(R[:, :-1] / scale, full_matrices=False)
    told = lengths > _OPEN * lengths[0]
    beta = (axes[told].T @ (U[:, told].T @ R[:, -1] / lengths[told])) / scale
    unknown = 1.0 - np.sum(axes[told] ** 2, axis=0) > _ITS_OWN
    nowhere = np.linalg.svd(axes[told])[2][told.sum() :]
    return _Fit(
        beta, np.where(unknown, np.inf, standard_errors(evidence)), nowhere.T / scale[:, None]
    )


def _own_error(evidence: RegressionData, found: _Fit) -> float:
    """Relative error of a fit on its own recordings."""
    R = merged(evidence.by_joint)
    left = float(np.linalg.norm(R[:, -1] - R[:, :-1] @ found.beta))
    return left / np.sqrt(float(squared_torque(R)) or 1.0)


def _solution(W: Array, tau: Array) -> Array:
    scale = np.linalg.norm(W, axis=0)
    return np.linalg.lstsq(W / scale, tau, rcond=_RIDGE)[0] / scale


def _change(
    evidence: RegressionData, theirs: Callable[[Array], float], as_they_are: float, least: float
) -> Change:
    """What has to change beside the others' parameters for the recording to be predicted."""
    base = evidence.base
    friction = [i for i, p in enumerate(base.kept_parameters) if p.kind != "inertial"]
    last = [i for i, p in enumerate(base.parameters) if p.kind == "inertial"][-10:]
    moves: dict[Change, Array] = {
        "friction": np.eye(len(base.kept_parameters))[:, friction],
        "load": base.K[:, last],
    }
    for name, directions in moves.items():
        if as_they_are - theirs(directions) > _EXPLAINED * (as_they_are - least):
            return name
    return "other"
