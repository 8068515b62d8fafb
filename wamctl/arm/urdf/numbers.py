"""Numbers of a URDF that a lenient reader would drop without a word.

Pinocchio leaves an inertial out that it cannot read, so that a decimal comma takes a link's weight
out of the gravity model; and a collision shape, so that the link hits nothing.
"""

import math
import re
from collections.abc import Iterator
from xml.etree import ElementTree

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_LIMITS = ("lower", "upper", "effort", "velocity")
_SIZES = {"sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}
_SHAPES = (*_SIZES, "box", "mesh")


def number_faults(urdf: str) -> list[str]:
    """Every number of links' inertials and of joints that cannot be meant, one sentence each.

    Args:
        urdf: text of the URDF.

    Raises:
        xml.etree.ElementTree.ParseError: no XML.
    """
    root = ElementTree.fromstring(urdf)
    faults = [f for link in root.iterfind("link") for f in link_faults(link)]
    faults += [f for link in root.iterfind("link") for f in collision_faults(link)]
    return faults + [f for joint in root.iterfind("joint") for f in joint_faults(joint)]


def link_faults(link: ElementTree.Element) -> Iterator[str]:
    """What is no number in the inertial of a link."""
    inertial = link.find("inertial")
    if inertial is None:
        return
    who = f"link {link.get('name')!r}"
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    yield from _single(mass, "value", f"mass of {who}", least=0.0)
    for name in _MOMENTS:
        yield from _single(tensor, name, f"{name} of {who}")
    yield from _origin(inertial.find("origin"), f"inertial of {who}")


def collision_faults(link: ElementTree.Element) -> Iterator[str]:
    """What is no number in the collision shapes of a link."""
    for collision in link.iterfind("collision"):
        who = f"collision shape of link {link.get('name')!r}"
        yield from _origin(collision.find("origin"), who)
        if not any(collision.find(f"geometry/{shape}") is not None for shape in _SHAPES):
            yield f"{who} has no shape ({', '.join(_SHAPES)})"
        for tag, sizes in _SIZES.items():
            for shape in collision.iterfind(f"geometry/{tag}"):
                for name in sizes:
                    yield from _single(shape, name, f"{name} of a {who}", least=0.0)
        for box in collision.iterfind("geometry/box"):
            yield from _triple(box.get("size", ""), f"size of a {who}")


def joint_faults(joint: ElementTree.Element) -> Iterator[str]:
    """What is no number in the origin, the axis and the limits of a joint."""
    who = f"joint {joint.get('name')!r}"
    yield from _origin(joint.find("origin"), who)
    if joint.get("type") == "fixed":
        return
    axis, limit = joint.find("axis"), joint.find("limit")
    if axis is not None:
        text = axis.get("xyz", "")
        yield from _triple(text, f"axis of {who}")
        if _are_numbers(text) and not any(float(x) for x in text.split()):
            yield f"axis of {who} is {text!r}, which has no direction"
    for name in _LIMITS if limit is not None else ():
        if limit is not None and limit.get(name) is not None:
            yield from _single(limit, name, f"{name} limit of {who}")


def _origin(origin: ElementTree.Element | None, who: str) -> Iterator[str]:
    if origin is None:
        return
    for name in ("xyz", "rpy"):
        text = origin.get(name)
        if text is not None:
            yield from _triple(text, f"origin {name} of {who}")


def _triple(text: str, what: str) -> Iterator[str]:
    if len(text.split()) != 3 or not _are_numbers(text):
        yield f"{what} is {text!r}, not three numbers"


def _single(
    element: ElementTree.Element | None, name: str, what: str, least: float = -math.inf
) -> Iterator[str]:
    text = None if element is None else element.get(name)
    if text is None:
        yield f"{what} is missing"
    elif not _are_numbers(text) or len(text.split()) != 1:
        yield f"{what} is {text!r}, not a number"
    elif float(text) < least:
        yield f"{what} is {text.strip()}, below {least:g}"


def _are_numbers(text: str) -> bool:
    """Whether all words are finite numbers with a decimal point."""
    return all(_NUMBER.fullmatch(x) and math.isfinite(float(x)) for x in text.split())
