"""How far the arm's parts are from each other and from what stands around: the URDF's shapes."""

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import Robot

_JOINTS_APART = 3


@dataclass(frozen=True)
class CollisionShapes:
    """The pairs of shapes that must stay apart.

    Shapes count when at least three joints lie between their links: nearer ones are kept apart by
    the joints' stops, and would touch by design.

    Attributes:
        geometry: Pinocchio's shapes and pairs. Treat it as read-only.
        pairs: names of the two shapes of each of the P pairs.
    """

    geometry: pin.GeometryModel
    pairs: tuple[tuple[str, str], ...]


def collision_shapes(robot: Robot) -> CollisionShapes:
    """The shapes of the robot's URDF; none where it has no collision elements.

    Raises:
        ConfigurationError: a shape that cannot be read, such as a mesh without its file.
    """
    try:
        geometry = pin.buildGeomFromUrdfString(robot.model, robot.urdf, pin.GeometryType.COLLISION)
    except (ValueError, RuntimeError) as error:
        reason = str(error).splitlines()[0]
        raise ConfigurationError("URDF", [f"no readable collision shapes ({reason})"]) from error
    shapes = geometry.geometryObjects
    for i, first in enumerate(shapes):
        for j, second in enumerate(shapes[:i]):
            if abs(first.parentJoint - second.parentJoint) >= _JOINTS_APART:
                geometry.addCollisionPair(pin.CollisionPair(j, i))
    names = _shape_names(robot.urdf)
    pairs = [(shapes[p.first].name, shapes[p.second].name) for p in geometry.collisionPairs]
    return CollisionShapes(geometry, tuple((names[a], names[b]) for a, b in pairs))


def _shape_names(urdf: str) -> dict[str, str]:
    """Name in the URDF by Pinocchio's name, which is the link's with a count."""
    links = ElementTree.fromstring(urdf).iter("link")
    return {
        f"{link.get('name')}_{i}": shape.get("name") or str(link.get("name"))
        for link in links
        for i, shape in enumerate(link.findall("collision"))
    }


def distances(robot: Robot, shapes: CollisionShapes, q: Array) -> Array:
    """Distance of each pair along a motion [m], shape (S, P); negative where shapes overlap.

    Args:
        robot: kinematics.
        shapes: the pairs.
        q: poses, shape (S, n) [rad].
    """
    data, geometry = robot.data(), pin.GeometryData(shapes.geometry)
    found = np.empty((len(q), len(shapes.pairs)))
    for i, pose in enumerate(q):
        pin.computeDistances(robot.model, data, shapes.geometry, geometry, pose)
        found[i] = [result.min_distance for result in geometry.distanceResults]
    return found
