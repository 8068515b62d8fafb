"""Recordings as a hypothesis takes them: an arm, a probe, and the regression that follows."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ident.dynamics.parameters import Terms
from ident.regression.probe import Probe
from ident.regression.probe_fit import (
    Columns,
    columns_of,
    error_of,
    fitted_residual,
    held_out_residual,
    shares,
)
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot


@dataclass(frozen=True)
class Case:
    """An arm and what was recorded of it, perhaps changed.

    Attributes:
        robot: kinematics, frames, and gravity.
        terms: how motors and joints are coupled.
        probe: the samples.
        springs: whether each joint has a spring, which the model of `ident run` lacks.
    """

    robot: Robot
    terms: Terms
    probe: Probe
    springs: bool = False

    @cached_property
    def columns(self) -> Columns:
        """The regression."""
        return columns_of(self.robot, self.terms, self.probe, self.springs)

    @cached_property
    def error(self) -> float:
        """Held-out relative error, every joint's torque counting alike."""
        return error_of(self.columns, held_out_residual(self.columns))

    @cached_property
    def fitted(self) -> float:
        """The same of torque that was fitted, which a poor motion does not make large."""
        return error_of(self.columns, fitted_residual(self.columns))

    @property
    def fitted_by_joint(self) -> Array:
        """Relative error of each joint on what was fitted, shape (n,)."""
        return shares(fitted_residual(self.columns), self.columns.tau)

    def better_by(self, ratio: float, other: "Case") -> bool:
        """Whether it explains torque so much better than another case, fitted as well as not.

        Where the motion is poor the error on torque that was not fitted is large, and falls by
        chance; but nothing wrong fits much better than the right.
        """
        return self.error <= ratio * other.error and self.fitted <= ratio * other.fitted

    @cached_property
    def residual(self) -> Array:
        """What a fit that has not seen it leaves of the torque [N m], shape (S, n)."""
        return held_out_residual(self.columns, np.ones(len(self.probe.moving)))

    @property
    def total(self) -> float:
        """Held-out relative error over all joints, as large as their torque."""
        torque = np.sum(self.columns.tau**2)
        return float(np.sqrt(np.sum(self.residual**2) / max(torque, 1e-300)))

    @property
    def by_joint(self) -> Array:
        """Held-out relative error of each joint in a fit where all count alike, shape (n,)."""
        return shares(held_out_residual(self.columns), self.columns.tau)

    def with_torque(
        self, factors: Array | float = 1.0, order: NDArray[np.intp] | None = None
    ) -> "Case":
        """The same with other torque: multiplied, or of other columns; the regressor stays."""
        places = np.arange(len(self.probe.moving)) if order is None else order
        tau, raw = (factors * x[:, places] for x in (self.probe.tau, self.probe.raw))
        found = replace(self, probe=replace(self.probe, tau=tau, raw=raw))
        if "columns" in self.__dict__:
            moved = np.where(self.probe.counted, tau, 0.0)
            found.__dict__["columns"] = self.columns.with_torque(moved)
        return found

    def with_gravity(self, gravity: Array) -> "Case":
        """The same under gravity of another direction [m/s^2], shape (3,)."""
        model = pin.Model(self.robot.model)
        model.gravity.linear = np.asarray(gravity, dtype=float)
        return replace(self, robot=replace(self.robot, model=model))
