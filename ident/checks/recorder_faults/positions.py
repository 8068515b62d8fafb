"""Positions in a scale of their own, encoders that drift, wrong zeros: the arm's weight tells them.

To first order a wrong position adds the model's derivative by position, times the error, to the
torque: `dtau/dq . q + dtau/dqd . qd + dtau/dqdd . qdd` for positions that are too large by a
factor, and `dtau/dq . t` for a drift. What such a column explains beside the links' own tells how
large the fault is; the arm is then fitted anew without it. A zero that is off may look like a
factor: the likelier of the two counts, and small ones are left to `ident gap`. A joint whose
turning changes no weight (about a vertical axis, or a last link) shows none of it, nor has its
model the fault.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.dynamics.regressor import Motion
from ident.regression.probe_fit import gram, held_out_residual, solution
from ident.signals.arrays import Array

_STEP = 1e-4
"""Relative step [1] or angle [rad] of a derivative."""

_INSTANTS = 150
_STEPS = 6
"""Steps to the size of a zero that is off: a large one is not linear in the torque."""

_Kind = Literal["scale", "drift", "zero"]


@dataclass(frozen=True)
class _Fault:
    """A fault of the positions.

    Attributes:
        kind: of what is wrong.
        joints: whose positions are wrong, from 0.
        size: to be added to the recorded positions [positions, or rad].
    """

    kind: _Kind
    joints: tuple[int, ...]
    size: float

    def without(self, case: Case) -> Case:
        """The case with the positions mended."""
        m, t = case.probe.motion, case.probe.t
        own = np.where(np.isin(np.arange(case.robot.dof), self.joints), self.size, 0.0)
        if self.kind == "scale":
            motion = Motion(*(x * (1.0 + own) for x in (m.q, m.qd, m.qdd)))
        else:
            course = _course(t) if self.kind == "drift" else np.ones_like(t)
            motion = replace(m, q=m.q + course[:, None] * own)
        return replace(case, probe=replace(case.probe, motion=motion))

    def large(self, bounds: CheckSettings) -> bool:
        """Whether it matters."""
        return abs(self.size) > (bounds.scale_off if self.kind == "scale" else bounds.angle_off_rad)

    def remark(self, case: Case, left: Array) -> Remark:
        """What is said of it, with the part of each joint's error that it leaves, shape (n,)."""
        every = len(self.joints) == int(case.probe.moving.sum()) > 1
        whose = "all joints" if every else joints(self.joints, case.robot.joint_names)
        if self.kind == "scale":
            text = (
                f"The recorded positions of {whose} appear to be about"
                f" {1.0 / (1.0 + self.size):.2g} times the true ones"
            )
            advice = (
                "Check the encoder's counts per turn and the gear ratio by which positions are"
                " computed."
            )
        elif self.kind == "zero":
            text = (
                f"The zero position of {whose} appears to be wrong: the URDF fits the torque better"
                f" if {self.size:.2g} rad are added to the recorded positions"
            )
            advice = "Find the zero again with the arm in its home pose, or correct it in the URDF."
        else:
            text = (
                f"The recorded position of {whose} appears to drift by about {-self.size:.2g} rad"
                " over the recording"
            )
            advice = (
                "Check that encoder for lost counts and a slipping coupling: let the joint return"
                " to one mark before and after the motion."
            )
        least = int(np.argmin(left))
        share = (
            f"what the model leaves of the torque of {joints([least], case.robot.joint_names)} then"
            f" falls to {100 * left[least]:.2g} % of what it is"
        )
        places = () if every else numbers(self.joints)
        code = "zero_pose" if self.kind == "zero" else "positions"
        return Remark(code, places, f"{text} ({share}).", Grade.DOUBTFUL, advice)


def position_remarks(case: Case, bounds: CheckSettings) -> list[Remark]:
    """What is said of positions in another scale, that drift, or whose zero is wrong."""
    weights = _weights(case)
    best, expected = min(_faults(case, weights), key=lambda one: one[1], default=(None, 1.0))
    if best is None or expected > np.sqrt(bounds.positions_ratio):
        return []
    if best.kind == "zero":
        best = _refined(case, weights, best)
    if not best.large(bounds) or (best.kind == "drift" and _beyond_motion(best, case)):
        return []
    before, after = (_left(c, weights) for c in (case, best.without(case)))
    ratio = np.divide(after, before, out=np.ones_like(before), where=weights > 0)
    if np.prod(ratio) > min(bounds.positions_ratio, _left_by_springs(case, weights, before)):
        return []
    return [best.remark(case, ratio)]


def _beyond_motion(fault: _Fault, case: Case) -> bool:
    """Whether a joint would have moved less by itself than its encoder drifted."""
    return abs(fault.size) > float(np.ptp(case.probe.motion.q[:, list(fault.joints)], axis=0).min())


def _left_by_springs(case: Case, weights: Array, before: Array) -> float:
    """Product over the joints of what is left of their errors with a spring at each."""
    after = _left(replace(case, springs=True), weights)
    return float(np.prod(np.divide(after, before, out=np.ones_like(before), where=weights > 0)))


def _course(t: Array) -> Array:
    """The recording's time from 0 to 1."""
    return (t - t[0]) / max(float(np.ptp(t)), 1e-9)


def _left(case: Case, weights: Array) -> Array:
    """Rms of each joint's torque that a fit which has not seen it leaves [N m], shape (n,)."""
    return np.sqrt(np.mean(held_out_residual(case.columns, weights) ** 2, axis=0))


def _weights(case: Case) -> Array:
    """Weights under which every joint's residual counts alike, shape (n,)."""
    left = np.sqrt(np.mean(held_out_residual(case.columns) ** 2, axis=0))
    return np.divide(1.0, left, out=np.zeros_like(left), where=case.probe.moving & (left > 0))


def _refined(case: Case, weights: Array, zero: _Fault) -> _Fault:
    """A zero with the size beside which its own column explains no more."""
    place = zero.kind, zero.joints
    for _ in range(_STEPS):
        rest = [f for f, _ in _faults(zero.without(case), weights) if (f.kind, f.joints) == place]
        zero = replace(zero, size=zero.size + sum(f.size for f in rest))
    return zero


def _faults(case: Case, weights: Array) -> Iterator[tuple[_Fault, float]]:
    """Each fault in the size that explains most, and the part of all joints' errors it leaves."""
    case = replace(case, probe=case.probe.every(-(-len(case.probe.t) // _INSTANTS)))
    W = case.columns.W * weights[:, None]
    A, y = gram(W, case.columns.tau * weights)
    beta = solution(A, y)
    residual = case.columns.tau * weights - W @ beta
    used = weights > 0
    before = np.maximum(np.sum(residual**2, axis=0)[used], 1e-300)
    for (kind, places), column in _changes(case, weights, beta).items():
        own = column - W @ solution(A, np.tensordot(W, column, axes=((0, 1), (0, 1))))
        square = float(np.sum(own**2))
        if square > 0.0:
            size = float(np.sum(own * residual)) / square
            after = np.sum((residual - size * own) ** 2, axis=0)[used]
            yield _Fault(kind, places, size), float(np.sqrt(np.prod(after / before)))


def _changes(case: Case, weights: Array, beta: Array) -> dict[tuple[_Kind, tuple[int, ...]], Array]:
    """Weighted torque per unit of each fault, shape (S, n), of an arm with parameters beta."""
    usual = (case.columns.W * weights[:, None]) @ beta

    def slope(kind: _Kind, k: int) -> Array:
        changed = _Fault(kind, (k,), _STEP).without(case).columns.W
        return ((changed * weights[:, None]) @ beta - usual) / _STEP

    found: dict[tuple[_Kind, tuple[int, ...]], Array] = {}
    course = _course(case.probe.t)[:, None]
    moving = np.flatnonzero(case.probe.moving & ~case.robot.sliding).tolist()
    for k in moving:
        found["scale", (k,)] = slope("scale", k)
        found["zero", (k,)] = slope("zero", k)
        found["drift", (k,)] = course * found["zero", (k,)]
    if len(moving) > 1:
        found["scale", tuple(moving)] = np.sum([found["scale", (k,)] for k in moving], axis=0)
    return found
