"""Where the arm's links are, each in the frame of the one before it."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.robot import Robot


@dataclass(frozen=True)
class Placement:
    """A link in its parent's frame.

    Attributes:
        parent, child: names of the links in the URDF.
        translation: [m], shape (3,).
        quaternion: x, y, z, w, shape (4,).
    """

    parent: str
    child: str
    translation: Array
    quaternion: Array


class Links:
    """The moving links of a robot.

    Args:
        robot: the arm.
    """

    def __init__(self, robot: Robot) -> None:
        self._model, self._data = robot.model, robot.data()
        bodies = [f for f in robot.model.frames if f.type == pin.FrameType.BODY]
        first = {f.parentJoint: f.name for f in reversed(bodies)}
        joints = range(1, robot.dof + 1)
        self._names = [(first[robot.model.parents[k]], first[k]) for k in joints]

    def at(self, q: Array) -> list[Placement]:
        """Their placements at a pose [rad], shape (n,)."""
        pin.forwardKinematics(self._model, self._data, q)
        found = []
        for k, (parent, child) in enumerate(self._names, 1):
            here = self._data.liMi[k]
            turn = pin.Quaternion(here.rotation).coeffs()
            found.append(Placement(parent, child, here.translation.copy(), np.array(turn)))
        return found
