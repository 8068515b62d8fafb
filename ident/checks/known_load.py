"""Gains of drives from a known load: their currents with it, beside those without it.

i_k = Y_k beta_k + friction of joint k + x_k / gain_k, where x_k is the load's torque at joint k in
the recordings that carry it, and zero in the others. Each joint has links of its own, so that
neither the gains' ratios nor masses from CAD take part. A known payload is the way of Gautier and
Briot (2014), who solve for all joints together.
"""

from dataclasses import dataclass

import numpy as np

from ident.checks.case import Case
from ident.checks.gains import Gains, gain_of, last_link
from ident.recordings.dataset import Dataset
from ident.regression.probe_fit import solution


@dataclass(frozen=True)
class KnownLoad:
    """A recording of the arm with a load of which mass and place are known.

    Attributes:
        data: the recording; nothing but the gains is taken from it.
        load: mass [kg], and its centre in the last link's parameter frame [m].
    """

    data: Dataset
    load: tuple[float, float, float, float]


def gains_of_load(case: Case, load: tuple[float, float, float, float]) -> Gains:
    """Current per torque of each joint that feels the load.

    Args:
        case: all recordings, of which the last one carries the load.
        load: mass [kg], and its centre in the last link's parameter frame [m].
    """
    probe, n = case.probe, case.robot.dof
    mass, c = load[0], np.array(load[1:])
    tensor = mass * (c @ c * np.eye(3) - np.outer(c, c))[np.triu_indices(3)]
    torque = last_link(case) @ np.concatenate([tensor, mass * c, [mass]])
    torque[probe.log != probe.log.max()] = 0.0
    value, sd, explained, weight = np.zeros((4, n))
    for k in np.flatnonzero(probe.moving & torque.any(axis=0)):
        at = probe.counted[:, k]
        W, goals = case.columns.W[at, k], np.column_stack([torque[at, k], probe.tau[at, k]])
        own = W[:, W.any(axis=0)]
        x, y = (goals - own @ solution(own.T @ own, own.T @ goals)).T
        value[k], sd[k], explained[k], weight[k] = gain_of(x, y)
    return Gains(value, sd, explained, weight, 0.0, 0.0, 0.0)
