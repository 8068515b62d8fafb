"""How much later the torque acts than its stamp says.

tau(t - d) = W beta reads tau = W beta + d dtau/dt to first order, so that the delay is one more
column of the regression. It confounds damping and elasticity, and is looked for before anything is
believed.
"""

from dataclasses import dataclass

import numpy as np

from ident.estimation.problem import solved
from ident.estimation.regression_data import ReducedRecording
from ident.regression.reduction import BLOCKS, block_of
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Delay:
    """Of one recording.

    Attributes:
        seconds: the torque acts this much later than its stamp; negative: earlier [s].
        sd: its standard error, by leaving out stretches [s].
        explained: share of the squared residual that it explains.
    """

    seconds: float
    sd: float
    explained: float = 0.0


def delay(log: ReducedRecording) -> Delay:
    """The delay that all joints of a recording share, each weighted by its noise."""
    excerpt = log.reduction.excerpt
    stretch = block_of(excerpt.t, log.reduction.span_s)
    joints = [j for j in range(excerpt.kept.shape[1]) if excerpt.kept[:, j].any()]
    rows = excerpt.rows(excerpt.tau_rate)
    beta = solved(np.sum([rows[j].T @ rows[j] for j in joints], axis=0))
    grams = np.zeros((BLOCKS, len(beta) + 1, len(beta) + 1))
    for j in joints:
        sigma = max(np.std(rows[j] @ np.append(-beta, 1.0)), 1e-12)
        inside = stretch[excerpt.kept[:, j]]
        for b in np.unique(inside):
            part = rows[j][inside == b] / sigma
            grams[b] += part.T @ part
    total = grams.sum(axis=0)
    used = [b for b in range(BLOCKS) if grams[b].any()]
    without = np.array([solved(total - grams[b])[0] for b in used])
    spread = (len(used) - 1) / len(used) * np.sum((without - without.mean()) ** 2)
    with_delay, without_delay = _left(total), _left(total[1:, 1:])
    explained = 1.0 - with_delay / without_delay if without_delay > 0.0 else 0.0
    return Delay(float(solved(total)[0]), float(np.sqrt(spread)), explained)


def _left(gram: Array) -> float:
    """Squared residual of normal equations [W | tau]^T [W | tau]."""
    x = np.append(-solved(gram), 1.0)
    return float(x @ gram @ x)
