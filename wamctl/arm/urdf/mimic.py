"""Joints that copy another's motion (`mimic` in a URDF): fingers of a gripper, or a linkage."""

from collections.abc import Sequence
from xml.etree import ElementTree

import pinocchio as pin


def pairs_of(urdf: str) -> dict[str, str]:
    """For each joint that mimics another the other's name.

    Args:
        urdf: text that has been read as a URDF already.
    """
    if "mimic" not in urdf:
        return {}
    found = {}
    for joint in ElementTree.fromstring(urdf).iterfind("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            found[joint.get("name", "")] = mimic.get("joint", "")
    return found


def named(pairs: dict[str, str], joints: Sequence[str]) -> list[str]:
    """What is wrong with a choice of joints: it holds some that do not move by themselves."""
    return [
        f"joint {one!r} moves with {other!r} (mimic): leave both out, and they are locked at zero"
        for one, other in pairs.items()
        if one in joints or other in joints
    ]


def in_the_way(pairs: dict[str, str], model: pin.Model) -> list[str]:
    """What is wrong with leaving out all pairs: other joints hang from them, or none is left."""
    coupled = {*pairs, *pairs.values()}
    faults = []
    for one, other in pairs.items():
        below = {model.names[k] for n in (one, other) for k in model.subtrees[model.getJointId(n)]}
        others = sorted(below - coupled)
        if others:
            faults.append(
                f"joint {one!r} moves with {other!r} (mimic) and carries {', '.join(others)}: such"
                " a linkage is no chain of independent joints, and cannot be modelled"
            )
    if not faults and coupled >= set(model.names) - {"universe"}:
        faults = named(pairs, list(coupled))
    return faults
