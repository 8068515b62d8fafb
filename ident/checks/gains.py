"""Size of the torque beside the weight and inertia that the URDF states, joint by joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.signals.arrays import Array
from wamctl.arm.robot import inverse_dynamics

_STRETCHES = 12
_LINK = 11
"""Columns of a link in the regression: ten of the rigid body, and the rotor's."""

_MOMENT = slice(6, 9)
"""First moment among the rigid body's."""

_DEPENDENT = 1e-3
"""Singular values beside the largest that are none."""


@dataclass(frozen=True)
class Gains:
    """Torque as recorded, per torque of the URDF's links; beside friction and offset.

    Attributes:
        value: of each joint, shape (n,); zero where the URDF says nothing.
        sd: its standard error, by leaving out stretches, shape (n,).
        explained: part of the torque beside friction that the URDF explains, shape (n,).
        weight: square of the URDF's torque beside friction [N^2 m^2], shape (n,).
        torque: square of the recorded torque beside friction [N^2 m^2], of all joints.
        common: one gain of all joints.
        common_explained: what the URDF explains with it.
    """

    value: Array
    sd: Array
    explained: Array
    weight: Array
    torque: float
    common: float
    common_explained: float


def gains(case: Case, rotors: bool = False) -> Gains:
    """The gains of a case.

    Args:
        case: the recording.
        rotors: whether a rotor, of which URDFs say nothing, may take its part of each joint's
            torque: then only weight and other joints' motion tell a gain.
    """
    probe = case.probe
    model = inverse_dynamics(case.robot, probe.motion.q, probe.motion.qd, probe.motion.qdd)
    n = case.robot.dof
    value, sd, explained, weight = np.zeros((4, n))
    goals = inner = 0.0
    for k in np.flatnonzero(probe.moving):
        x, y = _beside_friction(case, int(k), model, probe.tau, rotor=rotors)
        if x @ x < 1e-18 * max(float(model[:, k] @ model[:, k]), 1e-12):
            continue
        value[k], sd[k], explained[k], weight[k] = gain_of(x, y)
        inner, goals = inner + x @ y, goals + y @ y
    common = inner / weight.sum() if weight.any() else 0.0
    total = common * inner / goals if goals else 0.0
    return Gains(value, sd, explained, weight, float(goals), float(common), float(total))


@dataclass(frozen=True)
class Load:
    """A load at the last link that the URDF lacks: the other reading of torque that is too large.

    Attributes:
        mass_kg: of the load; None where the motion tells its moments alone.
        left: part of the torque beside friction that the URDF leaves with it, the joints' mean.
        left_by_factors: the same of the URDF with a factor at each joint instead.
        possible: whether its mass is positive, and its moments are those of a place near the arm.
    """

    mass_kg: float | None
    left: float
    left_by_factors: float
    possible: bool

    def explains(self, ratio: float) -> bool:
        """Whether it is possible, and leaves so much less than factors do."""
        return self.possible and self.left < ratio * self.left_by_factors


def load_of(case: Case, found: Gains) -> Load:
    """The load that fits best, where the gains of the case are known at some joint."""
    probe = case.probe
    model = inverse_dynamics(case.robot, probe.motion.q, probe.motion.qd, probe.motion.qdd)
    last = last_link(case)
    rows, goals, factors = [], [], []
    for k in np.flatnonzero(found.weight):
        x, y, own = _beside_friction(case, int(k), model, probe.tau, last)
        size = np.linalg.norm(y)
        if size == 0.0:
            continue  # no torque was recorded
        rows.append(own / size)
        goals.append((y - x) / size)
        factors.append(np.sum((y - found.value[k] * x) ** 2) / size**2)
    W, goal = np.concatenate(rows), np.concatenate(goals)
    scale = np.maximum(np.linalg.norm(W, axis=0), 1e-300)
    load, _, rank, _ = np.linalg.lstsq(W / scale, goal, rcond=_DEPENDENT)
    without = np.linalg.matrix_rank(W[:, :-1] / scale[:-1], rtol=_DEPENDENT)
    load = load / scale
    left = np.sum((goal - W @ load) ** 2) / len(factors)
    mass = float(load[-1]) if without < rank else None
    near = sum(np.linalg.norm(p.translation) for p in case.robot.model.jointPlacements)
    possible = mass is None or np.linalg.norm(load[_MOMENT]) < mass * near
    return Load(mass, float(left), float(np.mean(factors)), bool(possible))


def last_link(case: Case) -> Array:
    """Columns of the last link's tensor, first moment and mass, shape (S, n, 10)."""
    n = case.robot.dof
    return case.columns.W[:, :, _LINK * (n - 1) : _LINK * n - 1]


def of_rotors(case: Case, found: Gains) -> NDArray[np.bool_]:
    """Joints whose own rotor, of which URDFs say nothing, is a better reason than a factor, (n,).

    Args:
        case: the recording.
        found: its gains.
    """
    probe = case.probe
    model = inverse_dynamics(case.robot, probe.motion.q, probe.motion.qd, probe.motion.qdd)
    better = np.zeros(case.robot.dof, dtype=bool)
    for k in np.flatnonzero(found.weight):
        x, y, a = _beside_friction(case, int(k), model, probe.tau, probe.motion.qdd)
        rotor = max((y - x) @ a / max(a @ a, 1e-300), 0.0)
        better[k] = np.sum((y - x - rotor * a) ** 2) < np.sum((y - found.value[k] * x) ** 2)
    return better


def _beside_friction(case: Case, k: int, *signals: Array, rotor: bool = False) -> list[Array]:
    """A joint's part of some signals without what its friction, offset and spring explain of them.

    With `rotor`, without what the inertia of its own rotor explains, either.
    """
    probe, own = case.probe, case.probe.counted[:, k]
    friction = [probe.motion.qd[own, k], probe.sign[own, k], np.ones(own.sum())]
    friction += [probe.motion.qdd[own, k]] if rotor else []
    friction += [probe.motion.q[own, k]] if case.springs else []
    others = np.column_stack(friction)
    parts = (signal[own, k] for signal in signals)
    return [y - others @ np.linalg.lstsq(others, y, rcond=None)[0] for y in parts]


def gain_of(x: Array, y: Array) -> tuple[float, float, float, float]:
    """Least squares of y = gain x, both of shape (S,).

    Returns:
        The gain, its standard error by leaving out stretches, the part of the square of y that it
        explains, and the square of x.
    """
    weight = float(x @ x)
    gain = float(x @ y) / weight
    explained = 1 - np.sum((y - gain * x) ** 2) / max(float(y @ y), 1e-300)
    stretch = np.arange(len(x)) * _STRETCHES // len(x)
    xx = np.bincount(stretch, x * x, _STRETCHES)
    xy = np.bincount(stretch, x * y, _STRETCHES)
    left = np.maximum(xx.sum() - xx, 1e-300)
    without = (xy.sum() - xy) / left
    spread = np.sqrt((_STRETCHES - 1) / _STRETCHES * np.sum((without - without.mean()) ** 2))
    return gain, float(spread), float(explained), weight
