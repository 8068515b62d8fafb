"""The columns of a log's rows: base parameters, and beside them what may change in an arm.

A joint whose zero has moved changes the torque by its slope in the joint's position; friction that
rises at low speed adds a sign that fades with speed. Both are columns like those of the base
parameters, so that a triangle with them holds all that is ever asked of the log.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from ident.dynamics.base_parameters import BaseMap, base_map, whole_range
from ident.dynamics.regressor import Motion
from ident.model.arm import Arm
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot

_SPEED = 1  # which of the filtered velocities friction's direction follows


@dataclass(frozen=True)
class Name:
    """What one column stands for.

    Attributes:
        text: in result files.
        unit: SI.
        kind: `inertial`, `fv`, `fc`, `fo`, `ia`, `fvm`, `fcm`, `zero` or `stribeck`.
        joint: joint or link, from 1.
    """

    text: str
    unit: str
    kind: str
    joint: int


@dataclass(frozen=True)
class ZeroColumns:
    """Torque per turn of each joint's zero: the slope of CAD's torque, shape (S, n, n)."""

    robot: Robot

    @property
    def count(self) -> int:
        """Number of joints n."""
        return self.robot.dof

    def __call__(self, motion: Motion) -> Array:
        """Derivatives of the inverse dynamics (Carpentier, Mansard 2018, by Pinocchio)."""
        model, data = self.robot.model, self.robot.data()
        result = np.empty((*motion.q.shape, self.count))
        for s, sample in enumerate(zip(motion.q, motion.qd, motion.qdd, strict=True)):
            result[s] = pin.computeRNEADerivatives(model, data, *sample)[0]
        return result


@dataclass(frozen=True)
class FadingSign:
    """The direction of a joint's motion, fading with speed: sgn(v) exp(-|v| / scale).

    Attributes:
        scale: speed at which 1/e is left [rad/s].
        cutoff: which of the filtered velocities it follows.
    """

    scale: float
    cutoff: int = _SPEED

    def __call__(self, q: Array, speeds: Array) -> Array:
        """Values of one joint, shape (S,); arguments as of `SmoothedSign`."""
        v = speeds[self.cutoff]
        return np.sign(v) * np.exp(-np.abs(v) / self.scale)


@dataclass(frozen=True)
class Columns:
    """All columns of an arm's rows, p of them.

    Attributes:
        arm: the arm.
        speeds: of the fading signs [rad/s].
    """

    arm: Arm
    speeds: tuple[float, ...]

    @cached_property
    def base(self) -> BaseMap:
        """The base parameters of the whole arm, whatever a log holds still."""
        return base_map(self.arm.robot, self.arm.terms, [whole_range(self.arm.robot.dof)])

    @cached_property
    def further(self) -> ZeroColumns:
        """The columns of the joints' zeros."""
        return ZeroColumns(self.arm.robot)

    @property
    def curves(self) -> tuple[FadingSign, ...]:
        """The curves of friction at low speed."""
        return tuple(FadingSign(v) for v in self.speeds)

    @cached_property
    def names(self) -> tuple[Name, ...]:
        """Of the p columns: base parameters, zeros, then fading signs joint by joint."""
        kept = zip(self.base.names, self.base.kept_parameters, strict=True)
        base = [Name(text, p.unit, p.kind, p.index) for text, p in kept]
        joints = range(1, self.arm.robot.dof + 1)
        zeros = [Name(f"zero{j}", "rad", "zero", j) for j in joints]
        fading = [
            Name(f"stribeck{j} ({v:g} rad/s)", "N m", "stribeck", j)
            for j in joints
            for v in self.speeds
        ]
        return (*base, *zeros, *fading)

    @property
    def count(self) -> int:
        """Number of columns p."""
        return len(self.names)

    def wide(self, joint: int, W: Array, curves: Array, tau: Array) -> Array:
        """One joint's rows [all p columns | tau], shape (R, p + 1).

        Args:
            joint: from 0.
            W: base parameters and zeros, shape (R, b + n).
            curves: of this joint, shape (R, T).
            tau: shape (R,).
        """
        rows = np.zeros((len(W), self.count + 1))
        first = W.shape[1] + joint * len(self.speeds)
        rows[:, : W.shape[1]] = W
        rows[:, first : first + len(self.speeds)] = curves
        rows[:, -1] = tau
        return rows
