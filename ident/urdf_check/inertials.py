"""Masses and inertia tensors of links: which no body can have, or none that anybody would build."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from scipy.optimize import nnls

from ident.signals.arrays import Array
from ident.urdf_check.finding import Finding, Grade
from ident.urdf_check.xml_values import Element, number, set_tensor, tensor, triple

_DENSEST = 22_600.0
"""Osmium, the densest metal [kg/m^3]."""

_THINNEST = 1.2
"""Air [kg/m^3]."""

_ROUNDING = 1e-3
"""Of a tensor's largest moment: so much may be a matter of printed digits."""

_DIGITS = 1e-9
"""Of a tensor's largest moment: the rounding of the arithmetic."""

_POINT_M = 1e-6
"""A body whose mass lies nearer to its centre than this [m] is a point."""

_LIGHT = 1e-3
"""Lighter links [kg] stand for frames, whose tensors are chosen freely."""

ROOM = 1e-6
"""A repaired tensor keeps this share of its size from the border of what is possible."""

_MOMENTS_OF_SPREADS = np.ones((3, 3)) - np.eye(3)


def inertial_findings(link: Element, reach_m: float) -> Iterator[Finding]:
    """What is wrong with a link's inertial.

    Args:
        link: the element.
        reach_m: largest distance that the arm's own joints can make [m].
    """
    inertial = link.find("inertial")
    mass = None if inertial is None else number(inertial.find("mass"), "value")
    values = None if inertial is None else tensor(inertial)
    if inertial is None or mass is None or values is None or mass < 0:
        return  # the numbers themselves are wrong, and reported as such
    name = link.get("name", "")
    if mass == 0:
        yield from _massless(link, inertial, values)
        return
    yield from _tensor(name, inertial, mass, values)
    centre = triple(inertial.find("origin"), "xyz")
    if centre is not None and reach_m > 0 and np.linalg.norm(centre) > reach_m:
        yield Finding(
            Grade.DOUBT,
            "centre_far",
            "link",
            name,
            f"its centre of mass lies {np.linalg.norm(centre):.3g} m from its frame, and the whole"
            f" arm reaches only {reach_m:.3g} m: is it given in millimetres?",
        )


def _massless(link: Element, inertial: Element, values: Array) -> Iterator[Finding]:
    if values.any():
        yield Finding(
            Grade.FAULT,
            "inertia_without_mass",
            "link",
            link.get("name", ""),
            "has an inertia tensor but no mass, which no body has: give its mass",
            partial(link.remove, inertial),
            "the inertial taken out",
        )


def _tensor(name: str, inertial: Element, mass: float, values: Array) -> Iterator[Finding]:
    moments = np.linalg.eigvalsh(values)
    largest = float(np.abs(moments).max())
    if largest < mass * _POINT_M**2:
        yield Finding(
            Grade.NOTE,
            "point_mass",
            "link",
            name,
            f"is a point: {mass:g} kg without any rotational inertia",
        )
        return
    excess = -2.0 * float(spreads(values)[0])
    if excess > _DIGITS * largest:
        repaired = nearest_possible(values)
        yield Finding(
            Grade.FAULT if excess > _ROUNDING * largest else Grade.NOTE,
            "negative_inertia" if _is_negative(moments) else "triangle",
            "link",
            name,
            _impossible(moments, excess),
            partial(set_tensor, inertial, repaired),
            f"the nearest possible moments {_listed(np.linalg.eigvalsh(repaired))} kg m^2",
        )
    elif mass >= _LIGHT:
        yield from _density(name, mass, values)


def _is_negative(moments: Array) -> bool:
    return bool(moments[0] < -_DIGITS * np.abs(moments).max())


def _impossible(moments: Array, excess: float) -> str:
    if _is_negative(moments):
        return (
            f"its inertia about a principal axis is negative ({moments[0]:.3g} kg m^2), which no"
            " body's is"
        )
    return (
        f"its largest principal moment {moments[2]:.4g} kg m^2 is above the sum of the other two,"
        f" {moments[2] - excess:.4g} kg m^2, which no body's is"
    )


def _density(name: str, mass: float, values: Array) -> Iterator[Finding]:
    """A wrong unit of mass or inertia makes a body of impossible density."""
    try:
        found = density(mass, values)
    except ValueError:
        return  # a plate without thickness
    size = np.sqrt(5.0 * spreads(values) / mass)
    if _THINNEST <= found <= _DENSEST or size[0] < 1e-2 * size[2]:
        return
    words = "denser than any metal" if found > _DENSEST else "thinner than air"
    yield Finding(
        Grade.DOUBT,
        "density",
        "link",
        name,
        f"the body with its mass of {mass:.3g} kg and its inertia measures"
        f" {_listed(2 * size)} m across: {words} ({found:.2g} kg/m^3). Is the mass in kg, the"
        " inertia in kg m^2 about the centre of mass?",
    )


def _listed(values: Array) -> str:
    return " x ".join(f"{x:.3g}" for x in values)


def spreads(tensor: Array) -> Array:
    """Principal second moments of the mass about its centre [kg m^2], ascending, shape (3,).

    With principal moments L, they are (L1 + L2 + L3) / 2 - L: a body exists exactly if none is
    negative, which is the triangle inequality (Wensing, Kim, Slotine 2018).

    Args:
        tensor: about the centre of mass, shape (3, 3) [kg m^2].
    """
    moments = np.linalg.eigvalsh(tensor)
    return np.sort(moments.sum() / 2 - moments)


def nearest_possible(tensor: Array) -> Array:
    """The tensor that a body can have and that is nearest by the Frobenius norm, shape (3, 3).

    The set of possible tensors is convex and does not change under rotations, so that the nearest
    one has the same principal axes.
    """
    moments, axes = np.linalg.eigh(tensor)
    least = ROOM * np.abs(moments).max()
    found, _ = nnls(_MOMENTS_OF_SPREADS, moments - 2 * least)
    return (axes * (_MOMENTS_OF_SPREADS @ (found + least))) @ axes.T


def density(mass: float, tensor: Array) -> float:
    """Density of the solid ellipsoid with this mass and tensor [kg/m^3].

    Raises:
        ValueError: a tensor that no body of finite thickness has.
    """
    second = spreads(tensor)
    if second[0] <= 0:
        raise ValueError("the body has no thickness")
    semi_axes = np.sqrt(5.0 * second / mass)
    return float(mass / (4.0 / 3.0 * np.pi * np.prod(semi_axes)))
