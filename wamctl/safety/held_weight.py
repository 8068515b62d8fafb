"""Whether the torques that hold the arm fit its weight, or some motor gives more or less than told.

While a motor is moved to and fro, friction is as often with it as against it, so that the mean of
its torque is what its links weigh: no rotor, inertia or friction is in it. What may differ from the
model is the CAD's own error and a tool of which the model does not know, both the same in every
pose. A motor's scale is told where neither of the two explains the torques: of a shoulder in one
pose, of an elbow, whose torque a tool can explain, in two.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.robot import Robot
from wamctl.arm.transmission import Transmission

_CAD = 0.1  # deviation of a link's mass, and of its centre in radii of gyration
_FRICTION_LEFT = 0.1  # share of the friction that a mean over whole periods keeps: 0.03 of dry
# friction, 0.1 where it grows with the load by a sixth of that, and so differs by direction
_TOOL = np.array([6.0, 0.6, 0.6, 0.6])  # deviations of its mass, and of that times its centre
_AGREEMENT = 1.45  # factor between a motor's scale by weight and by motion: links, friction
DISTANCE = 3.3
"""In standard deviations, beyond which neither CAD's error nor a tool explains the torques."""
SCALE = 1.3
"""Factor by which a motor's torque must be wrong at least to be told."""


@dataclass(frozen=True)
class Explanation:
    """What explains the torques that hold the arm best.

    Attributes:
        load_kg: a tool beyond the model's.
        distance: how much it leaves over, in standard deviations of all motors together.
        motor: the motor whose scale explains most of that.
        scale: torque of that motor over the commanded one, by what the others show.
        rest: what that scale leaves over of the distance.
        weighings: poses in which that motor was weighed.
    """

    load_kg: float
    distance: float
    motor: int
    scale: float
    rest: float
    weighings: int

    def fault(self, shown: tuple[float, float]) -> str | None:
        """Why the motor is not as it should be, as the start of a sentence; or None.

        A hose or a spring at a joint changes what is held, too, but by no one scale in two poses,
        and not how the motor moves. In one pose any pull looks like a scale: there, the motion must
        show one as well; in two, it must not show the contrary.

        Args:
            shown: lowest and highest scale that its motion shows.
        """
        is_found = self.rest <= DISTANCE < self.distance and self.scale > 0.0
        if not is_found or 1.0 / SCALE < self.scale < SCALE:
            return None
        low, high = np.log(np.maximum(shown, 1e-9)) * np.sign(self.scale - 1.0)
        least, most = min(low, high), max(low, high)
        if most < abs(math.log(self.scale)) - math.log(_AGREEMENT):
            return None
        if self.weighings == 1 and least < 0.0:
            return None
        return (
            f"motor {self.motor + 1} gives {self.scale:.2f} times the torque that it is told to "
            "give, by the weight that it holds, and no tool would explain it: look at its ratio, "
            "its torque constant, and what else pulls at its joint"
        )


def explanation(
    robot: Robot, transmission: Transmission, tool: str, poses: Array, held: Array, friction: Array
) -> Explanation:
    """What explains the torques that hold the arm.

    Generalised least squares with the errors of the CAD and the tool as noise, which the poses
    share; a motor's scale is one more unknown, which makes its torques wrong in all of them.

    Args:
        robot: rigid-body model.
        transmission: motors and joints.
        tool: frame at which a tool may be.
        poses: one or more, shape (P, n) [rad].
        held: mean torque of each motor while it moved to and fro, motor side; not a number where
            it did not, shape (P, n) [N m].
        friction: Coulomb friction to expect on the motors, shape (n,) [N m].
    """
    to_motor = transmission.joint_from_motor.T
    data, weights, errors, tools = robot.data(), [], [], []
    for q in poses:
        weights.append(to_motor @ pin.computeGeneralizedGravity(robot.model, data, q))
        pin.computeJointJacobians(robot.model, data, q)
        errors.append(to_motor @ _cad_errors(robot, data))
        tools.append(to_motor @ _tools(robot, data, tool) * _TOOL)
    known = np.isfinite(held).ravel()
    error, tool_nm = np.concatenate(errors)[known], np.concatenate(tools)[known]
    left = (held.ravel() - np.concatenate(weights))[known]
    noise = _FRICTION_LEFT * np.tile(friction, len(poses))[known]
    without_tool = error @ error.T + np.diag(noise**2)
    precision = np.linalg.inv(without_tool + tool_nm @ tool_nm.T)
    load_kg = _TOOL[0] * float(tool_nm[:, 0] @ precision @ left)
    if load_kg < 0.0:  # no tool weighs less than nothing
        precision, load_kg = np.linalg.inv(without_tool), 0.0
    its = np.array([np.diag(row) for row in held]).reshape(-1, len(friction))[known]
    pulls, sizes = its.T @ precision @ left, np.diag(its.T @ precision @ its)
    motor = int(np.argmax(pulls**2 / np.maximum(sizes, 1e-12)))
    scale = float(1.0 - pulls[motor] / sizes[motor]) if sizes[motor] else np.inf
    squared = float(left @ precision @ left)
    explained = pulls[motor] ** 2 / sizes[motor] if sizes[motor] else 0.0
    rest = math.sqrt(max(0.0, squared - explained))
    weighings = int(np.isfinite(held[:, motor]).sum())
    return Explanation(load_kg, math.sqrt(squared), motor, scale, rest, weighings)


def _cad_errors(robot: Robot, data: pin.Data) -> Array:
    """Gravity torque of one standard deviation of each number of the CAD, shape (n, 4 n)."""
    model, columns = robot.model, []
    for k in range(1, model.njoints):
        inertia = model.inertias[k]
        gyration = float(np.sqrt(np.trace(inertia.inertia) / 2.0 / inertia.mass))
        columns.append(_CAD * inertia.mass * _weight(robot, data, k, inertia.lever))
        for axis in np.eye(3):
            moment = _weight(robot, data, k, axis) - _weight(robot, data, k, np.zeros(3))
            columns.append(_CAD * gyration * inertia.mass * moment)
    return np.array(columns).T


def _tools(robot: Robot, data: pin.Data, tool: str) -> Array:
    """Gravity torque of a kilogram at the tool point, and of a kilogram metre along each axis."""
    frame = robot.model.frames[robot.model.getFrameId(tool)]
    place = frame.placement
    at_point = _weight(robot, data, frame.parentJoint, place.translation)
    axes = [
        _weight(robot, data, frame.parentJoint, place.translation + place.rotation[:, a]) - at_point
        for a in range(3)
    ]
    return np.array([at_point, *axes]).T


def _weight(robot: Robot, data: pin.Data, joint: int, point: Array) -> Array:
    """Torque that holds a kilogram at a point of a link, shape (n,) [N m]."""
    jacobian = pin.getJointJacobian(robot.model, data, joint, pin.LOCAL).reshape(6, robot.dof)
    turned = data.oMi[joint].rotation
    at_point = turned @ (jacobian[:3] - pin.skew(point) @ jacobian[3:])
    return -at_point.T @ robot.model.gravity.linear
