"""Size of the torque beside the weight and inertia that the URDF states, joint by joint."""

from dataclasses import dataclass

import numpy as np

from ident.checks.case import Case
from ident.signals.arrays import Array
from wamctl.arm.robot import inverse_dynamics

_STRETCHES = 12


@dataclass(frozen=True)
class Gains:
    """Torque as recorded, per torque of the URDF's links; beside friction and offset.

    Attributes:
        value: of each joint, shape (n,); zero where the URDF says nothing.
        sd: its standard error, by leaving out stretches, shape (n,).
        explained: part of the torque beside friction that the URDF explains, shape (n,).
        weight: square of the URDF's torque beside friction [N^2 m^2], shape (n,).
        common: one gain of all joints.
        common_explained: what the URDF explains with it.
    """

    value: Array
    sd: Array
    explained: Array
    weight: Array
    common: float
    common_explained: float


def gains(case: Case) -> Gains:
    """The gains of a case."""
    probe = case.probe
    model = inverse_dynamics(case.robot, probe.motion.q, probe.motion.qd, probe.motion.qdd)
    n = case.robot.dof
    value, sd, explained, weight = np.zeros((4, n))
    goals = inner = 0.0
    for k in np.flatnonzero(probe.moving):
        others = np.column_stack([probe.motion.qd[:, k], probe.sign[:, k], np.ones(len(probe.t))])
        x, y = _beside(others, model[:, k]), _beside(others, probe.tau[:, k])
        if x @ x < 1e-18 * max(float(model[:, k] @ model[:, k]), 1e-12):
            continue
        weight[k] = x @ x
        value[k] = (x @ y) / weight[k]
        sd[k] = _spread(x, y)
        explained[k] = 1 - np.sum((y - value[k] * x) ** 2) / max(float(y @ y), 1e-300)
        inner, goals = inner + x @ y, goals + y @ y
    common = inner / weight.sum() if weight.any() else 0.0
    total = common * inner / goals if goals else 0.0
    return Gains(value, sd, explained, weight, float(common), float(total))


def _beside(others: Array, signal: Array) -> Array:
    """The signal without what the others explain of it."""
    return signal - others @ np.linalg.lstsq(others, signal, rcond=None)[0]


def _spread(x: Array, y: Array) -> float:
    """Standard error of y / x, by leaving out stretches."""
    stretch = np.arange(len(x)) * _STRETCHES // len(x)
    xx = np.bincount(stretch, x * x, _STRETCHES)
    xy = np.bincount(stretch, x * y, _STRETCHES)
    left = np.maximum(xx.sum() - xx, 1e-300)
    without = (xy.sum() - xy) / left
    return float(np.sqrt((_STRETCHES - 1) / _STRETCHES * np.sum((without - without.mean()) ** 2)))
