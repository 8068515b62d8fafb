"""The ten inertial parameters of a link, in the paper's order, and their change of frame."""

import numpy as np

from wamctl.arm.arrays import Array

INERTIAL_NAMES = ("xx", "xy", "xz", "yy", "yz", "zz", "x", "y", "z", "m")
"""Order of (8) without friction: Lxx Lxy Lxz Lyy Lyz Lzz [kg m^2], lx ly lz [kg m], m [kg]."""

# Pinocchio's vector is [m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz].
PINOCCHIO_INDEX = (4, 5, 7, 6, 8, 9, 1, 2, 3, 0)


def parameter_name(suffix: str, link: int) -> str:
    """Name as Table I prints it: `L2xx`, `l3y`, `m4` (links count from 1)."""
    if suffix == "m":
        return f"m{link}"
    return f"L{link}{suffix}" if len(suffix) == 2 else f"l{link}{suffix}"


def pseudo_inertia(delta: Array) -> Array:
    """Pseudo-inertia P = [[Sigma, l], [l^T, m]], shape (4, 4), with Sigma = tr(L)/2 E - L.

    P > 0 holds for exactly those parameters that a distribution of positive mass can have: it
    contains the triangle inequality of the principal moments, which (22) does not (Wensing, Kim,
    Slotine 2018).

    Args:
        delta: shape (10,), one link in the order of `INERTIAL_NAMES`.
    """
    xx, xy, xz, yy, yz, zz, x, y, z, m = delta
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    sigma = 0.5 * np.trace(tensor) * np.eye(3) - tensor
    first = np.array([[x], [y], [z]])
    return np.block([[sigma, first], [first.T, np.array([[m]])]])


def from_pseudo_inertia(p: Array) -> Array:
    """Inverse of `pseudo_inertia`: shape (.., 4, 4) to (.., 10)."""
    sigma = p[..., :3, :3]
    trace = np.trace(sigma, axis1=-2, axis2=-1)[..., None, None]
    rows, columns = np.triu_indices(3)
    upper = (trace * np.eye(3) - sigma)[..., rows, columns]
    return np.concatenate([upper, p[..., :3, 3], p[..., 3:, 3]], axis=-1)


_UNITS = np.array([pseudo_inertia(e) for e in np.eye(10)])


def change_of_frame(placement: Array) -> Array:
    """Matrix A, shape (10, 10), with delta_a = A delta_b for one link seen from two frames.

    Args:
        placement: homogeneous matrix T of frame b in frame a, shape (4, 4): x_a = T x_b. The
            pseudo-inertia follows P_a = T P_b T^T.
    """
    seen = np.array([placement @ unit @ placement.T for unit in _UNITS])
    return np.ascontiguousarray(from_pseudo_inertia(seen).T)
