"""Torque of the wrong sign: friction would feed the motion instead of braking it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.regression.probe_fit import gram, solution, weights_of
from ident.signals.arrays import Array

_STRETCHES = 12


@dataclass(frozen=True)
class FrictionPower:
    """Power that friction takes, beside rms torque times rms speed.

    Attributes:
        value: of each joint, shape (n,); friction that brakes is positive.
        sd: its standard error, by leaving out stretches, shape (n,).
    """

    value: Array
    sd: Array

    def negative(self, least: float, deviations: float) -> NDArray[np.bool_]:
        """Joints whose friction feeds the motion, shape (n,)."""
        return (self.value < -least) & (self.value < -deviations * self.sd)

    def positive(self, least: float, deviations: float) -> NDArray[np.bool_]:
        """Joints whose friction brakes it, shape (n,)."""
        return (self.value > least) & (self.value > deviations * self.sd)


def friction_power(case: Case) -> FrictionPower:
    """The power of friction in the least squares of all samples."""
    c, probe = case.columns, case.probe
    w = weights_of(c.tau)
    stretch = probe.log * _STRETCHES + np.arange(len(probe.t)) * _STRETCHES // len(probe.t)
    parts = [np.flatnonzero(stretch == s) for s in np.unique(stretch)]
    grams = [gram(c.W[p] * w[:, None], c.tau[p] * w) for p in parts]
    A, y = np.sum([g[0] for g in grams], axis=0), np.sum([g[1] for g in grams], axis=0)
    size = np.sqrt(np.mean(c.tau**2, axis=0) * np.mean(probe.motion.qd**2, axis=0))

    def power(beta: Array) -> Array:
        joint = np.arange(len(w))[:, None]
        own = c.W[:, joint, c.friction]
        torque = np.einsum("sjk,jk->sj", own, beta[c.friction])
        mean = np.mean(torque * probe.motion.qd, axis=0)
        return np.divide(mean, size, out=np.zeros_like(mean), where=size > 0)

    without = np.array([power(solution(A - a, y - b)) for a, b in grams])
    count = len(grams)
    spread = (count - 1) / count * np.sum((without - without.mean(axis=0)) ** 2, axis=0)
    return FrictionPower(power(solution(A, y)), np.sqrt(spread))
