"""The identified arm link by link, in the joint frames that other formats use."""

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from ident.model.identified_model import Model
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm
from wamctl.arm.errors import DataError
from wamctl.arm.inertial import pseudo_inertia
from wamctl.arm.robot import Robot, with_parameters


@dataclass(frozen=True)
class Link:
    """A link with its joint; the link's frame is the joint's.

    Attributes:
        joint: the joint's name.
        body: the link's name.
        parent: its parent's place in the list of links, or None for the base.
        placement: homogeneous matrix of its frame in the parent's, shape (4, 4).
        slides: whether the joint is prismatic.
        axis: unit vector, shape (3,).
        lower, upper: limits of the joint [rad or m].
        effort: limit of its torque [N m or N].
        mass: [kg].
        center: centre of mass [m], shape (3,).
        inertia: tensor about the centre of mass [kg m^2], shape (3, 3).
        viscous: joint friction [N m s/rad].
        coulomb: joint friction [N m].
    """

    joint: str
    body: str
    parent: int | None
    placement: Array
    slides: bool
    axis: Array
    lower: float
    upper: float
    effort: float
    mass: float
    center: Array
    inertia: Array
    viscous: float
    coulomb: float

    @property
    def tensor(self) -> Array:
        """Inertia tensor about the joint's frame [kg m^2], shape (3, 3)."""
        c = self.center
        return self.inertia + self.mass * (c @ c * np.eye(3) - np.outer(c, c))


def identified_links(model: Model, arm: SimulatedArm) -> list[Link]:
    """The links from the base outwards.

    Args:
        model: the identified arm.
        arm: the same with its effects: links and joint friction are taken from it.

    Raises:
        DataError: parameters that no mass distribution can have; other programs refuse them.
    """
    _check_possible(model, arm.delta)
    return links_of(with_parameters(model.robot, arm.delta), arm.viscous, arm.coulomb)


def links_of(robot: Robot, viscous: Array, coulomb: Array) -> list[Link]:
    """The links of a robot from the base outwards.

    Args:
        robot: kinematics and inertials.
        viscous: joint friction [N m s/rad], shape (n,).
        coulomb: joint friction [N m], shape (n,).
    """
    bodies = {
        joint.attrib["name"]: _child(joint)
        for joint in ElementTree.fromstring(robot.urdf).iter("joint")
        if joint.find("child") is not None
    }
    links = []
    for k, name in enumerate(robot.joint_names, 1):
        motion, slides = robot.motion_subspaces[k - 1], bool(robot.sliding[k - 1])
        body, above = robot.model.inertias[k], robot.model.parents[k]
        links.append(
            Link(
                joint=name,
                body=bodies[name],
                parent=above - 1 if above > 0 else None,
                placement=robot.model.jointPlacements[k].homogeneous,
                slides=slides,
                axis=motion[:3] if slides else motion[3:],
                lower=float(robot.model.lowerPositionLimit[k - 1]),
                upper=float(robot.model.upperPositionLimit[k - 1]),
                effort=float(robot.model.effortLimit[k - 1]),
                mass=body.mass,
                center=body.lever,
                inertia=body.inertia,
                viscous=float(viscous[k - 1]),
                coulomb=float(coulomb[k - 1]),
            )
        )
    return links


def held_joints(model: Model) -> str:
    """A sentence on the joints that the data say nothing of; empty where all moved."""
    held = [
        name for name, moved in zip(model.robot.joint_names, model.moving, strict=True) if not moved
    ]
    return f"held in the recordings, so not identified: {', '.join(held)}" if held else ""


def _child(joint: ElementTree.Element) -> str:
    child = joint.find("child")
    return "" if child is None else child.attrib["link"]


def _check_possible(model: Model, delta: Array) -> None:
    for k, name in enumerate(model.robot.joint_names):
        least = float(np.linalg.eigvalsh(pseudo_inertia(delta[10 * k : 10 * k + 10]))[0])
        if least <= 0:
            raise DataError(
                f"The {model.estimator} model of {model.arm} cannot be exported: the link of"
                f" {name} has a pseudo-inertia with the eigenvalue {least:.3g}, and no mass"
                " distribution has one below 0; export the feasible model."
            )
