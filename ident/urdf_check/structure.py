"""Names and tree of a URDF: what hangs from what, and what moves without mass."""

from collections import Counter
from collections.abc import Iterator
from functools import partial

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
    parents = Counter()
    for joint in root.iterfind("joint"):
        for end in ("parent", "child"):
            name = _end(joint, end)
            if name not in links:
                text = f"its {end} is {name!r}, and there is no such link"
                yield _fault("tree", "joint", joint.get("name", ""), text)
        parents[_end(joint, "child")] += 1
    for name, count in parents.items():
        if count > 1 and name in links:
            yield _fault("tree", "link", name, f"is the child of {count} joints")
    roots = sorted(links - set(parents))
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


def _end(joint: Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _fault(code: str, kind: str, name: str, sentence: str) -> Finding:
    return Finding(Grade.FAULT, code, kind, name, sentence)
