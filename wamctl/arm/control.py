"""Trajectory tracking: computed torque with the CAD model and a PD law (paper, V-B)."""

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.config import ControllerSection
from wamctl.arm.robot import Robot


@dataclass(frozen=True)
class Setpoint:
    """What the arm is to do in one cycle; arrays of shape (n,).

    Attributes:
        q: position [rad].
        qd: velocity [rad/s].
        qdd: acceleration [rad/s^2].
    """

    q: Array
    qd: Array
    qdd: Array


@dataclass(frozen=True)
class ComputedTorque:
    """The control law (47): tau = M(q) alpha + c(q, qd) + g(q), with PD on acceleration.

    Where model and arm agree, each joint's error obeys e'' + 2 zeta w e' + w^2 e = 0, by (48). In
    torque the stiffness is M w^2, so that the same bandwidth is gentle on light links.

    Attributes:
        robot: rigid-body model, with CAD parameters.
        stiffness: w^2 per joint, shape (n,) [1/s^2].
        damping: 2 zeta w per joint, shape (n,) [1/s].
    """

    robot: Robot
    stiffness: Array
    damping: Array
    _data: pin.Data = field(repr=False)

    def torque(self, q: Array, qd: Array, wanted: Setpoint) -> Array:
        """Joint torque [N m], shape (n,), towards the set-point."""
        alpha = wanted.qdd + self.stiffness * (wanted.q - q) + self.damping * (wanted.qd - qd)
        return pin.rnea(self.robot.model, self._data, q, qd, alpha)

    def release(self, q: Array, qd: Array, held: float) -> Array:
        """Joint torque [N m], shape (n,), that lets the arm sink: damping, and a share of gravity.

        Args:
            q: measured position [rad], shape (n,).
            qd: measured velocity [rad/s], shape (n,).
            held: share of gravity that is carried, 1 to 0.
        """
        model, data = self.robot.model, self._data
        gravity = pin.computeGeneralizedGravity(model, data, q).copy()
        return pin.rnea(model, data, q, 0.0 * qd, -self.damping * qd) - (1.0 - held) * gravity


def computed_torque(robot: Robot, section: ControllerSection) -> ComputedTorque:
    """The controller of a configuration."""
    bandwidth = np.array(section.bandwidth_rad_s)
    return ComputedTorque(
        robot, bandwidth**2, 2.0 * section.damping_ratio * bandwidth, robot.data()
    )
