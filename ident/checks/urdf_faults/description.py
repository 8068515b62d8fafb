"""What is wrong with the arm's description, before any recording is looked at."""

from xml.etree import ElementTree

import numpy as np

from ident.checks.remark import Grade, Remark, joints, numbers
from wamctl.arm.robot import Robot

_CORRECT = (
    "Correct its inertial element, or let `ident check-urdf FILE.urdf --out repaired.urdf` repair"
    " it."
)
_GIVE = "Give a URDF with the true mass and inertia of each link."
_LEAST_ALIKE = 3
"""So many links of the same mass and inertia are placeholders."""


def description_remarks(robot: Robot) -> list[Remark]:
    """Links that no arm can have, and links without mass."""
    return [*_impossible(robot), *_empty(robot), *_placeholders(robot)]


def _impossible(robot: Robot) -> list[Remark]:
    """Moving links of negative mass or of an inertia that is negative about some axis."""
    tree, found = ElementTree.fromstring(robot.urdf), []
    moving = _moving_links(tree, robot)
    for link in tree.iterfind("link"):
        name, inertial = link.get("name", ""), link.find("inertial")
        if inertial is None or name not in moving:
            continue
        mass = _number(inertial.find("mass"), "value")
        inertia = _tensor(inertial.find("inertia"))
        least = float(np.linalg.eigvalsh(inertia)[0])
        if mass < 0:
            text = (
                f"Link {name} has a mass of {mass:g} kg in the URDF, which is physically"
                " impossible."
            )
            found.append(Remark("impossible_link", (), text, Grade.REFUSED, _CORRECT))
        elif least < -1e-9 * max(float(np.trace(inertia)), 1e-12):
            text = (
                f"Link {name} has a negative moment of inertia in the URDF ({least:.3g} kg m^2),"
                " which is physically impossible."
            )
            found.append(Remark("impossible_link", (), text, Grade.DOUBTFUL, _CORRECT))
    return found


def _moving_links(tree: ElementTree.Element, robot: Robot) -> set[str]:
    """Links that the arm's joints carry; those of its base have no part in any torque."""
    joints = [
        (joint.get("name"), parent.get("link"), child.get("link", ""))
        for joint in tree.iterfind("joint")
        if (parent := joint.find("parent")) is not None
        and (child := joint.find("child")) is not None
    ]
    found = {child for name, _, child in joints if name in robot.joint_names}
    while more := {child for _, parent, child in joints if parent in found} - found:
        found |= more
    return found


def _number(element: ElementTree.Element | None, name: str) -> float:
    return 0.0 if element is None else float(element.get(name, 0.0))


def _tensor(element: ElementTree.Element | None) -> np.ndarray:
    xx, xy, xz, yy, yz, zz = (
        _number(element, f"i{axes}") for axes in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _empty(robot: Robot) -> list[Remark]:
    masses = [robot.model.inertias[k].mass for k in range(1, robot.dof + 1)]
    empty = [k for k, mass in enumerate(masses) if mass == 0.0]
    if not empty:
        return []
    whose = (
        "All links"
        if len(empty) == robot.dof
        else f"The links of {joints(empty, robot.joint_names)}"
    )
    text = (
        f"{whose} have no mass in the URDF, so the unit of the torque cannot be checked, nor can"
        " the base parameters be divided among the links."
    )
    return [Remark("no_inertials", numbers(empty), text, Grade.DOUBTFUL, _GIVE)]


def _placeholders(robot: Robot) -> list[Remark]:
    links = [robot.model.inertias[k] for k in range(1, robot.dof + 1)]
    first = links[0]
    alike = [
        x.mass == first.mass and np.array_equal(x.inertia, first.inertia) for x in links if x.mass
    ]
    if first.mass == 0.0 or len(alike) < max(_LEAST_ALIKE, len(links)) or not all(alike):
        return []
    text = (
        f"All links in the URDF have the same mass ({first.mass:g} kg) and inertia: these look like"
        " placeholders, so the unit of the torque cannot be checked."
    )
    return [Remark("no_inertials", (), text, Grade.DOUBTFUL, _GIVE)]
