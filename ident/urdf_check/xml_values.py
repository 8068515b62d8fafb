"""Numbers out of a URDF, and back into it."""

from xml.etree import ElementTree

import numpy as np

from ident.signals.arrays import Array

Element = ElementTree.Element

_ENTRIES = {
    "ixx": (0, 0),
    "ixy": (0, 1),
    "ixz": (0, 2),
    "iyy": (1, 1),
    "iyz": (1, 2),
    "izz": (2, 2),
}


def number(element: Element | None, name: str) -> float | None:
    """An attribute as a number; None where there is none."""
    text = None if element is None else element.get(name)
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


def triple(element: Element | None, name: str) -> Array | None:
    """An attribute as three numbers, shape (3,); None where there are none."""
    words = "" if element is None else element.get(name, "")
    try:
        values = np.array([float(word) for word in words.split()])
    except ValueError:
        return None
    return values if values.shape == (3,) else None


def tensor(inertial: Element) -> Array | None:
    """The inertia tensor in the inertial's own axes, shape (3, 3); None where a number is bad."""
    found = np.zeros((3, 3))
    for name, (i, j) in _ENTRIES.items():
        value = number(inertial.find("inertia"), name)
        if value is None or not np.isfinite(value):
            return None
        found[i, j] = found[j, i] = value
    return found


def set_tensor(inertial: Element, values: Array) -> None:
    """Write an inertia tensor, shape (3, 3)."""
    element = inertial.find("inertia")
    if element is None:
        element = ElementTree.SubElement(inertial, "inertia")
    for name, place in _ENTRIES.items():
        element.set(name, f"{values[place]:.9g}")
