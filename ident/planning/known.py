"""How well the logs so far know an answer, and how likely they make a new log by it.

An answer is an effect, not its numbers: masses, the curves of friction and the effect's size are
fitted to the logs so far, which leave them open a little. What a new motion shows of them is no
evidence for or against the answer, and is wrong alike in all its rows. So each block of time is
predicted by the numbers as all blocks before it tell them, with their error: the likelihood of a
linear model whose coefficients have a normal prior, taken in turn (Dawid 1984, "the prequential
approach"). The rule is written down with the answer before the motion: the inner products of its
columns in the logs. Friction may turn round otherwise than any mixture that was fitted, at speeds
that no log has seen least of all: each joint's curve is open along a part of the mixture's curves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain
from ident.dynamics.compiled_regressor import regressor
from ident.effects.bound_effects import members_of
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.compensation import observed_along
from ident.effects.observation import Observed
from ident.effects.observing import CurrentModel
from ident.effects.reversal_friction import BASIS, SmoothedSign
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.blocks import FOLDS
from ident.gap.data.windows import Windows, body_step, windows_for
from ident.gap.regression.design_matrix import build_design_matrix
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import Fit
from ident.model.identified_model import Model
from ident.planning.noise import Noise, rows_of_block
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array

Turns = tuple[Array, Array]

_CURVES = [
    *(BASIS.index(SmoothedSign(w, 1)) for w in (0.001, 0.003, 0.0065, 0.013, 0.035)),
    *(BASIS.index(SmoothedSign(w, 1, True)) for w in (0.004, 0.022)),
    *(BASIS.index(SmoothedSign(d, None)) for d in (2e-4, 1.6e-3)),
]
"""Along which friction is open, beside the fitted mixture."""

_GROUPS = 12  # of rows, in which a prediction is set against what was measured
_ALIKE = 4.0  # neighbouring rows that count as one
_OPEN = 1e-9  # of a column's squares: what no log tells is open, but not without end


@dataclass(frozen=True)
class Known:
    """What the logs so far tell of an answer's numbers.

    Attributes:
        inertial: numbers of the links' parameters among them, shape (b,).
        products: inner products of the columns of these, of viscous friction, of each joint's
            mixture and open curves, and of the effects, in units of the noise, shape (p, p).
    """

    inertial: NDArray[np.int64]
    products: Array

    def content(self) -> dict[str, Any]:
        """As a plan keeps it: the upper triangle of the products."""
        upper = self.products[np.triu_indices(len(self.products))]
        return {"inertial": self.inertial.tolist(), "products": upper.tolist()}


def known_of(
    rows: WindowedRows, model: CurrentModel, effects: Sequence[Candidate], found: Fit
) -> Known:
    """What rows tell of the numbers of a fit.

    Args:
        rows: of all logs so far.
        model: with which the effects' columns are formed.
        effects: of the fit.
        found: the fit.
    """
    design = build_design_matrix(rows, model, effects)
    equations = design.equations.of(range(FOLDS))
    n, b = equations.dof, equations.base
    of_joint = 1 + len(_CURVES)
    first = b + n + n * of_joint + np.cumsum([0, *(e.width for e in design.index)])
    products = np.zeros((first[-1], first[-1]))
    for j, layout in enumerate(equations.layouts):
        pick = np.zeros((layout.torque + 1, first[-1]))
        pick[np.arange(len(layout.base)), layout.base] = 1.0
        pick[layout.viscous, b + j] = 1.0
        curves, mixture = layout.first_reversal, b + n + j * of_joint
        pick[curves : curves + layout.reversals, mixture] = found.structure.shapes[j]
        pick[curves + np.array(_CURVES), mixture + 1 + np.arange(len(_CURVES))] = 1.0
        for i, effect in enumerate(design.index):
            if j in effect.joints:
                pick[design.places(i, j), first[i] + np.arange(effect.width)] = 1.0
        weighted = np.tensordot(1.0 / found.sigma[j] ** 2, equations.products[j][0], axes=1)
        products += pick.T @ weighted @ pick
    return Known(rows.base_parameters, products)


def read_known(content: dict[str, Any]) -> Known:
    """What a plan keeps.

    Raises:
        LookupError, TypeError, ValueError: the content is none.
    """
    upper = np.array(content["products"], dtype=float)
    size = round((np.sqrt(8.0 * len(upper) + 1.0) - 1.0) / 2.0)
    products = np.zeros((size, size))
    products[np.triu_indices(size)] = upper
    inertial = np.array(content["inertial"], dtype=np.int64)
    return Known(inertial, products + np.triu(products, 1).T)


@dataclass(frozen=True)
class Prediction:
    """What an answer predicts of a recording.

    Attributes:
        left: of the torque, in the mean of each window [N m], shape (R, n).
        columns: windowed torque per unit of what is known only with an error, shape (R, n, p).
        sigma: noise that was written down [N m], shape (R, n); infinite where a joint is held.
    """

    left: Array
    columns: Array
    sigma: Array


def predictions(
    model: Model, known: Known, noise: Noise, data: Dataset, motion: Sequence[SmoothedSegment]
) -> list[Prediction]:
    """What an answer predicts of each stretch of a recording.

    Args:
        model: the answer.
        known: what the logs before tell of its numbers.
        noise: of the prediction, the same for all answers.
        data: the recording.
        motion: its stretches.

    Raises:
        DataError: an effect that is not known.
    """
    windows = windows_for(data.rate_hz, noise.cutoff_hz)
    found = []
    for s in motion:
        seen, torque = observed_along(model, data, s)
        left = windows.mean(s.tau - torque)
        columns = _columns(model, known, seen, s, windows)
        found.append(Prediction(left, columns, noise.of_rows(s.speeds[1], windows)))
    return found


def squares_of(found: Sequence[Prediction]) -> Array:
    """Sum of the squared errors of each joint in units of the noise, shape (n,)."""
    return sum(((p.left / p.sigma) ** 2).sum(axis=0) for p in found) + np.zeros(1)


def log_likelihood(found: Sequence[Prediction], known: Known, windows: Windows) -> Array:
    """Logarithm of the likelihood of each block and joint [nats], shape (B, n).

    What all answers share is left out.

    Args:
        found: what the answer predicts, stretch by stretch.
        known: what the logs before tell of its numbers.
        windows: of the rows.
    """
    weighted = [p.columns / p.sigma[..., None] for p in found]
    squares = np.diag(known.products) + sum((c**2).sum(axis=(0, 1)) for c in weighted)
    scale = np.sqrt(np.where(squares > 0.0, squares, 1.0))
    size, n = rows_of_block(windows), found[0].left.shape[1]
    products = known.products / np.outer(scale, scale) + _OPEN * np.eye(len(scale))
    shift, volume = np.zeros(len(scale)), _volume(scipy.linalg.cholesky(products))
    nats = []
    for item, columns in zip(found, weighted, strict=True):
        for first in range(0, len(columns) - size + 1, size):
            block = slice(first, first + size)
            for j in range(n):
                own = columns[block, j] / scale
                left = item.left[block, j] / item.sigma[block, j] - own @ shift
                products = products + own.T @ own
                root = scipy.linalg.cholesky(products)
                told = own.T @ left
                step = scipy.linalg.cho_solve((root, False), told)
                before, volume = volume, _volume(root)
                nats.append(-(left @ left - told @ step) / 2.0 - (volume - before) / 2.0)
                shift = shift + step
    return np.array(nats).reshape(-1, n)


def left_by_others(torque: Array, columns: Array, known: Array, sigma: Array) -> Array:
    """What other numbers would leave of a torque, in units of the noise, shape (R, n).

    Args:
        torque: windowed [N m], shape (R, n).
        columns: windowed torque per unit of what is known only with an error, shape (R, n, p).
        known: inner products of these columns in the logs so far, shape (p, p).
        sigma: noise [N m], shape (R, n).
    """
    own, seen = columns / sigma[..., None], torque / sigma
    products = known + np.einsum("rnp,rnq->pq", own, own, optimize=True)
    scale = np.sqrt(np.where(np.diag(products) > 0.0, np.diag(products), 1.0))
    scaled = products / np.outer(scale, scale) + _OPEN * np.eye(len(scale))
    told = np.einsum("rnp,rn->p", own, seen) / scale
    return seen - own @ (scipy.linalg.solve(scaled, told, assume_a="pos") / scale)


def against_rival(
    leader: Sequence[Prediction], rival: Sequence[Prediction], known: Known
) -> dict[str, Any]:
    """What the leader predicts beyond a rival, and what was measured, at one joint.

    At the joint at which they differ most, in groups of rows of alike predictions, less what other
    numbers of the rival would make up for. Measured is as much as predicted where the leader is
    right, and nothing where the rival is.

    Args:
        leader: what it predicts, in all stretches.
        rival: the same of the rival.
        known: what the logs before tell of the rival's numbers.
    """
    own, left = (np.concatenate([p.left for p in found]) for found in (leader, rival))
    columns, sigma = (np.concatenate([getattr(p, n) for p in rival]) for n in ("columns", "sigma"))
    predicted, measured = (
        left_by_others(torque, columns, known.products, sigma) for torque in (left - own, left)
    )
    joint = int((predicted**2).sum(axis=0).argmax())
    weight, x, y = 1.0 / sigma[:, joint], predicted[:, joint], measured[:, joint]
    groups = np.array_split(np.argsort(x * sigma[:, joint]), _GROUPS)
    found = []
    for rows in groups:
        total = float((weight[rows] ** 2).sum())
        means = [float(weight[rows] @ v[rows]) / total for v in (x, y)]
        scatter = weight[rows] * y[rows] - weight[rows] ** 2 * means[1]
        found.append((*means, float(np.sqrt(_ALIKE * (scatter**2).sum())) / total))
    names = ("predicted_nm", "measured_nm", "sd_nm")
    return {"joint": joint + 1} | dict(zip(names, map(list, zip(*found, strict=True)), strict=True))


def open_columns(
    chain: Chain, known: Known, motion: tuple[Array, Array, Array], turns: Turns, windows: Windows
) -> Array:
    """Windowed torque per unit of each number but the effects' sizes, shape (R, n, p).

    Args:
        chain: kinematics and gravity.
        known: which numbers.
        motion: position, velocity and acceleration [rad, rad/s, rad/s^2], each of shape (S, n).
        turns: smoothed signs of the velocity, shape (S, n), and velocities by each cut-off [rad/s],
            shape (C, S, n).
        windows: of the samples.
    """
    (q, qd, _), (direction, speeds) = motion, turns
    every = body_step(windows)
    coarse, middle = windows.coarser(every), slice(every // 2, None, every)
    links = coarse.mean(
        regressor(chain, *(np.ascontiguousarray(x[middle]) for x in motion))[:, :, known.inertial]
    )
    viscous, joints = windows.mean(qd), range(q.shape[1])
    curves = [np.stack([BASIS[k](q[:, j], speeds[..., j]) for j in joints], -1) for k in _CURVES]
    turning = np.stack([windows.mean(x) for x in (direction, *curves)], axis=-1)
    rows, n, of_joint = turning.shape
    friction = np.zeros((rows, n, n * of_joint))
    for j in joints:
        friction[:, j, j * of_joint : (j + 1) * of_joint] = turning[:, j]
    return np.concatenate([links[:rows], viscous[:, None] * np.eye(n), friction], axis=2)


def _columns(
    model: Model, known: Known, seen: Observed, motion: SmoothedSegment, windows: Windows
) -> Array:
    """Windowed torque per unit of each number, shape (R, n, p)."""
    turns = seen.direction, motion.speeds
    parts = [open_columns(seen.arm.chain, known, (seen.q, seen.qd, seen.qdd), turns, windows)]
    rows, n, _ = parts[0].shape
    for h, _ in members_of(model):
        own = windows.mean(catalogue()[h.effect].columns(seen, h))
        whole = np.zeros((rows, n, own.shape[2]))
        whole[:, list(h.rows)] = own
        parts.append(whole)
    return np.concatenate(parts, axis=2)


def _volume(root: Array) -> float:
    """Logarithm of the determinant, from a triangular root."""
    return 2.0 * float(np.log(np.diag(root)).sum())
