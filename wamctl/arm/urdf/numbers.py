"""Numbers of a URDF that a lenient reader would drop without a word: inertials, axes, limits.

Pinocchio leaves an inertial out that it cannot read, so that a decimal comma takes a link's weight
out of the gravity model.
"""

import math
import re
from collections.abc import Iterator
from xml.etree import ElementTree

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_LIMITS = ("lower", "upper", "effort", "velocity")


def number_faults(urdf: str) -> list[str]:
    """Every number of links' inertials and of joints that cannot be meant, one sentence each.

    Args:
        urdf: text of the URDF; text that is no XML has no faults here.
    """
    try:
        root = ElementTree.fromstring(urdf)
    except ElementTree.ParseError:
        return []
    faults = [f for link in root.iterfind("link") for f in _link_faults(link)]
    return faults + [f for joint in root.iterfind("joint") for f in _joint_faults(joint)]


def _link_faults(link: ElementTree.Element) -> Iterator[str]:
    inertial = link.find("inertial")
    if inertial is None:
        return
    who = f"link {link.get('name')!r}"
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    yield from _single(mass, "value", f"mass of {who}", least=0.0)
    for name in _MOMENTS:
        yield from _single(tensor, name, f"{name} of {who}")
    yield from _origin(inertial.find("origin"), f"inertial of {who}")


def _joint_faults(joint: ElementTree.Element) -> Iterator[str]:
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
