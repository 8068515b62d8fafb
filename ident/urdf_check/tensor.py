"""What inertia tensors bodies can have, and how dense such a body would be."""

import numpy as np
from scipy.optimize import nnls

from ident.signals.arrays import Array

ROOM = 1e-6
"""A repaired tensor keeps this share of its size from the border of what is possible."""

_MOMENTS_OF_SPREADS = np.ones((3, 3)) - np.eye(3)


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
