"""One Gauss-Newton step over coefficients and nonlinear parameters together, with covariance.

The model is linearised in the nonlinear parameters by central differences. The variance is the
cluster-robust (sandwich) one, with scores summed over blocks of time and all joints, since
residuals of neighbouring rows are correlated (Liang and Zeger 1986). Beside a reference model it
has a second part: what an error of the reference's parameters does to the unknowns. What the model
gets wrong alike counts as in `ident.identification.standard_errors`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import EXCLUDED, FOLDS
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix, build_design_matrix
from ident.gap.regression.model_columns import joint_columns
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.sandwich import block_labels, block_sums, sandwich
from ident.gap.regression.weighted_fit import Fit, fit, solve
from ident.signals.arrays import Array

_DIFFERENCE = 0.02  # of a parameter, for its derivative
_LONGEST_STEP = 0.3  # of a parameter
_DETERMINED = 0.99  # of an unknown: of less the ridge of the solution decides, not the rows


@dataclass(frozen=True)
class Linearised:
    """The fit on all data, and derivatives by nonlinear parameters.

    Attributes:
        design: with the effects' columns.
        fit: on all folds.
        parameters: names of the free nonlinear parameters of each effect.
        slopes: torque's derivative by each of them [N m per unit], per joint, shape (R,).
    """

    design: DesignMatrix
    fit: Fit
    parameters: tuple[tuple[str, ...], ...]
    slopes: list[list[Array]]


def linearised(
    rows: WindowedRows,
    end: CurrentFit,
    effects: Sequence[Candidate],
    parameters: Sequence[tuple[str, ...]],
) -> Linearised:
    """Linearise the model about some effects.

    Args:
        rows: the rows.
        end: the model with all effects.
        effects: the same effects, their parameters perhaps moved.
        parameters: names of those to take derivatives by, for each effect.
    """
    moved = [
        catalogue()[h.effect].moved(h, {name: h.numbers[name] * (1 + sign * _DIFFERENCE)})
        for h, names in zip(effects, parameters, strict=True)
        for name in names
        for sign in (1, -1)
    ]
    design = build_design_matrix(rows, end.model, effects, moved)
    structure = design.structure(end.fit.structure.shapes)
    now = fit(design.equations.of(range(FOLDS)), structure, end.fit.sigma)
    slopes, index = [], len(effects)
    for h, names, values in zip(effects, parameters, now.effects, strict=True):
        for name in names:
            up, down = (_torque(design, index + k, values) for k in (0, 1))
            width = 2 * _DIFFERENCE * h.numbers[name]
            slopes.append([(a - b) / width for a, b in zip(up, down, strict=True)])
            index += 2
    return Linearised(design, now, tuple(parameters), slopes)


def _torque(design: DesignMatrix, index: int, values: Array) -> list[Array]:
    """Torque of an effect per joint, shape (R,)."""
    felt = design.index[index].joints
    return [
        design.effect_columns(index, j) @ values if j in felt else np.zeros(len(columns))
        for j, columns in enumerate(design.columns)
    ]


def solution(
    rows: WindowedRows, at: Linearised, block_s: float, systematic: bool = False
) -> tuple[Array, Array]:
    """Unknowns of the fit followed by steps of the nonlinear parameters, and their variances.

    Args:
        rows: the rows.
        at: the model, linearised.
        block_s: blocks of time whose residuals count as independent [s].
        systematic: whether the variances hold what comes again with each period of the motion, and
            half the square of the move with weights that trust reversals less, and are infinite
            where the rows do not determine an unknown: its column is a sum of others.
    """
    size, more = len(at.fit.x), len(at.slopes)
    total = size + more
    normal, right = np.zeros((2, total, total)), np.zeros((2, total))
    labels = block_labels(rows, at.design, block_s)
    scores = np.zeros((2, labels[0].max() + 1, total))
    wrong = rows.parameter_errors
    known = np.zeros((total, wrong.shape[2]))
    for j, model in enumerate(joint_columns(at.design.equations, at.fit.structure)):
        columns = at.design.columns[j]
        if len(columns) == 0:
            continue
        used = at.design.fold != EXCLUDED
        sigma = at.fit.sigma[j][at.design.region[:, j]]
        weight = (used / sigma**2)[:, None]
        steeper = weight * (sigma.min() / sigma)[:, None] ** 2
        nominal = model.of(columns)
        own = np.column_stack([nominal, *(s[j] for s in at.slopes)])
        where = np.concatenate([model.unknown, size + np.arange(more)])
        error = columns[:, -1] - nominal @ at.fit.x[model.unknown]
        weighted = own * weight
        for k, x in enumerate((weighted, own * steeper)):
            normal[k][np.ix_(where, where)] += own.T @ x
            right[k, where] += x.T @ columns[:, -1]
        for k, label in enumerate(labels):
            scores[k][:, where] += block_sums(weighted * error[:, None], label, scores.shape[1])
        known[where] += weighted.T @ wrong[:, j]
    inverse, x = solve(normal[0], np.eye(total)), solve(normal[0], right[0])
    freedom = total / at.design.equations.dof
    variance = sandwich(scores[0], inverse, freedom)
    if systematic:
        variance = np.maximum(variance, sandwich(scores[1], inverse, freedom))
        variance += 0.5 * (solve(normal[1], right[1]) - x) ** 2
        seen = np.einsum("ij,ji->i", inverse, normal[0])  # part of each that the rows determine
        variance[(seen < _DETERMINED) & (np.diag(normal[0]) > 0.0)] = np.inf
    return x, variance + np.sum((inverse @ known) ** 2, axis=1)


def stepped(
    effects: Sequence[Candidate], parameters: Sequence[tuple[str, ...]], steps: Array
) -> tuple[Candidate, ...]:
    """The effects with their nonlinear parameters moved, within bounds and not far."""
    moved, place = [], 0
    for h, names in zip(effects, parameters, strict=True):
        effect, changes = catalogue()[h.effect], {}
        known = {p.name: p for p in effect.nonlinear}
        for name in names:
            value = h.numbers[name]
            most = _LONGEST_STEP * abs(value)
            step = float(np.clip(steps[place], -most, most))
            changes[name] = float(np.clip(value + step, known[name].lower, known[name].upper))
            place += 1
        moved.append(effect.moved(h, changes))
    return tuple(moved)


def refit(rows: WindowedRows, end: CurrentFit, now: Fit, effects: Sequence[Candidate]) -> Fit:
    """The fit on all data with other columns of the same effects."""
    design = build_design_matrix(rows, end.model, effects)
    structure = replace(now.structure, effects=design.index)
    return fit(design.equations.of(range(FOLDS)), structure, now.sigma)
