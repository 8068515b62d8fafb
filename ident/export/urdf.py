"""The identified arm as URDF: inertials, viscous and Coulomb friction of every joint."""

import re
from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ident.export.left_out import (
    effects_left_out,
    exported_arm,
    parameters_left_out,
    sentence,
)
from ident.export.links import Link, held_joints, identified_links
from ident.model.identified_model import Model

_STANDARD_GRAVITY = (0.0, 0.0, -9.81)
_HELD = ("delta", "viscous", "coulomb")
_MOVING = ("revolute", "continuous", "prismatic", "planar", "floating")


def to_urdf(model: Model) -> str:
    """The arm's own URDF with the identified parameters in it.

    Every inertial of the arm stands at its joints' links: those of links that are fixed to them are
    part of the identified ones, and removed. Joints that are not the model's become fixed.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    links = {link.joint: link for link in identified_links(model, exported_arm(model).arm)}
    root = ElementTree.fromstring(model.robot.urdf)
    for element in root.findall("link"):
        for inertial in element.findall("inertial"):
            element.remove(inertial)
    bodies = {element.attrib["name"]: element for element in root.findall("link")}
    for joint in root.findall("joint"):
        link = links.get(joint.attrib["name"])
        if link is not None:
            bodies[link.body].insert(0, _inertial(link))
            _set_dynamics(joint, link)
        elif joint.attrib["type"] in _MOVING:
            _lock(joint)
    ElementTree.indent(root)
    words = "; ".join([f"{model.arm}, {model.estimator} model", *left_out_of_urdf(model)])
    head = f'<?xml version="1.0"?>\n<!-- Identified: {comment(words)} -->\n'
    return head + ElementTree.tostring(root, encoding="unicode") + "\n"


def left_out_of_urdf(model: Model) -> list[str]:
    """What the model holds and URDF has no place for."""
    kinds = {
        "rotor inertia": ("ia",),
        "torque offset": ("fo",),
        "friction of coupled motors": ("fvm", "fcm"),
    }
    missing = parameters_left_out(model, kinds) + effects_left_out(model, _HELD, lambda _: False)
    words = sentence("URDF", missing)
    gravity = model.robot.model.gravity.linear
    if np.any(gravity != np.array(_STANDARD_GRAVITY)):
        words.append(f"gravity is not along -z: set it to {numbers(gravity)} m/s^2")
    return words + [s for s in (held_joints(model),) if s]


def comment(text: str) -> str:
    """A text as the inside of an XML comment: printable, and without two dashes in a row."""
    return re.sub(r"-(?=-)|-$", "- ", re.sub(r"[^\x20-\x7e]", "_", text))


def numbers(values: Sequence[float] | NDArray) -> str:
    """Numbers with all their digits, with blanks in between."""
    return " ".join(repr(float(x)) for x in values)


def _inertial(link: Link) -> ElementTree.Element:
    inertial = ElementTree.Element("inertial")
    ElementTree.SubElement(inertial, "origin", xyz=numbers(link.center), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(link.mass))
    i = link.inertia
    entries = {
        "ixx": i[0, 0],
        "ixy": i[0, 1],
        "ixz": i[0, 2],
        "iyy": i[1, 1],
        "iyz": i[1, 2],
        "izz": i[2, 2],
    }
    ElementTree.SubElement(
        inertial, "inertia", {name: repr(float(x)) for name, x in entries.items()}
    )
    return inertial


def _set_dynamics(joint: ElementTree.Element, link: Link) -> None:
    for old in joint.findall("dynamics"):
        joint.remove(old)
    ElementTree.SubElement(
        joint, "dynamics", damping=repr(link.viscous), friction=repr(link.coulomb)
    )


def _lock(joint: ElementTree.Element) -> None:
    joint.set("type", "fixed")
    for part in list(joint):
        if part.tag in ("axis", "limit", "dynamics", "mimic", "safety_controller"):
            joint.remove(part)
