"""Names and tree of a URDF: what hangs from what, and what moves without mass."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from xml.etree import ElementTree

import numpy as np

from ident.urdf_check.finding import Finding, Grade
from ident.urdf_check.xml_values import Element, number, triple


def structure_findings(root: Element) -> Iterator[Finding]:
    """What is wrong with the names and the tree."""
    if not root.get("name"):
        text = "the robot has no name, without which readers refuse the file"
        repair = partial(root.set, "name", "robot")
        yield Finding(Grade.FAULT, "name", "robot", "", text, repair, "name robot")
    for kind in ("link", "joint"):
        counts = Counter(element.get("name") for element in root.iterfind(kind))
        for name, count in counts.items():
            if not name:
                yield _fault("name", kind, "", f"{count} without a name")
            elif count > 1:
                yield _fault("name", kind, name, f"{count} {kind}s have this name")
    links = {link.get("name", "") for link in root.iterfind("link")}
    parents = Counter(_end(joint, "child") for joint in root.iterfind("joint"))
    named = links | {_end(joint, "parent") for joint in root.iterfind("joint")}
    roots = sorted(named - set(parents) - {""})
    base = roots[0] if len(roots) == 1 and roots[0] not in links else None  # such as "world"
    for joint in root.iterfind("joint"):
        for end in ("parent", "child"):
            name = _end(joint, end)
            if name in links:
                continue
            text = f"its {end} is {name!r}, and there is no such link"
            found = _fault("tree", "joint", joint.get("name", ""), text)
            if name == base:
                repair = partial(_add_link, root, name)
                found = replace(found, repair=repair, repaired_to=f"an empty link {name!r}")
            yield found
    for name, count in parents.items():
        if count > 1 and name in links:
            yield _fault("tree", "link", name, f"is the child of {count} joints")
    if len(roots) != 1 and links:
        words = ", ".join(roots) or "none: the joints close a circle"
        text = f"a robot hangs from one link, this one from {len(roots)} ({words})"
        yield _fault("tree", "robot", root.get("name", ""), text)


def massless_findings(root: Element) -> Iterator[Finding]:
    """Moving joints with nothing behind them that has mass."""
    children: dict[str, list[Element]] = {}
    for joint in root.iterfind("joint"):
        children.setdefault(_end(joint, "parent"), []).append(joint)
    masses = {
        link.get("name", ""): number(link.find("inertial/mass"), "value") or 0.0
        for link in root.iterfind("link")
    }
    for joint in root.iterfind("joint"):
        if joint.get("type") == "fixed":
            continue
        behind = list(_behind(_end(joint, "child"), children, set()))
        if not any(masses.get(name, 0.0) for name in behind):
            text = f"moves {', '.join(behind)}, without any mass: give the inertial"
            yield Finding(Grade.NOTE, "no_mass", "joint", joint.get("name", ""), text)


def reach_m(root: Element) -> float:
    """Sum of the distances between joint frames, and of what sliding joints add [m]."""
    total = 0.0
    for joint in root.iterfind("joint"):
        place = triple(joint.find("origin"), "xyz")
        total += 0.0 if place is None else float(np.linalg.norm(place))
    return total


def _behind(link: str, children: dict[str, list[Element]], seen: set[str]) -> Iterator[str]:
    if link in seen:
        return
    seen.add(link)
    yield link
    for joint in children.get(link, []):
        yield from _behind(_end(joint, "child"), children, seen)


def _add_link(root: Element, name: str) -> None:
    if not any(link.get("name") == name for link in root.iterfind("link")):
        ElementTree.SubElement(root, "link", name=name)


def _end(joint: Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _fault(code: str, kind: str, name: str, sentence: str) -> Finding:
    return Finding(Grade.FAULT, code, kind, name, sentence)
