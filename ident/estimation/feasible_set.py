"""The set D of physically possible parameters as cones of delta, (19) and (22)-(28).

Each constraint reads `A delta - b` in a cone: the half line for friction and other linear bounds,
the positive semidefinite matrices for a link. A symmetric matrix is written as its upper triangle,
column by column, off-diagonal entries times sqrt(2), which keeps inner products (the form that
Clarabel takes).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.parameters import NON_NEGATIVE, Parameter
from ident.signals.arrays import Array
from wamctl.arm.inertial import pseudo_inertia

Form = Literal["pseudo_inertia", "paper"]

MARGIN = 1e-6
"""The infinitesimal epsilon of (38), in units of the link's own size; for friction in SI units."""


@dataclass(frozen=True)
class Constraint:
    """A delta - b must lie in a cone.

    Attributes:
        joint: link or joint, from 1; 0 for the whole arm.
        text: the constraint in words.
        side: 0 for inequalities, else the side of the positive semidefinite matrix.
        A: shape (rows, p).
        b: shape (rows,).
    """

    joint: int
    text: str
    side: int
    A: Array
    b: Array


@dataclass(frozen=True)
class LinkSize:
    """What a link measures: its mass [kg], and its radius of gyration [m]."""

    mass: float
    radius: float


_UNKNOWN = LinkSize(mass=1.0, radius=0.1)


def link_sizes(delta: Array, parameters: Sequence[Parameter]) -> dict[int, LinkSize]:
    """Sizes of all links by their CAD parameters; a common guess where those are impossible."""
    sizes = {}
    for link in links_of(parameters):
        matrix = pseudo_inertia(delta[link_places(parameters, link)])
        second, mass = np.trace(matrix[:3, :3]), matrix[3, 3]
        possible = second > 0 and mass > 0
        sizes[link] = LinkSize(mass, float(np.sqrt(second / mass))) if possible else _UNKNOWN
    return sizes


def feasible_set(
    parameters: Sequence[Parameter],
    sizes: dict[int, LinkSize],
    form: Form = "pseudo_inertia",
) -> list[Constraint]:
    """All constraints of (17) on delta.

    Args:
        parameters: the p entries of delta.
        sizes: each link's own size, which its matrix is measured in.
        form: `pseudo_inertia`: 4 x 4, triangle inequality included; `paper`: 6 x 6 of (22).
    """
    return link_constraints(parameters, sizes, form) + sign_constraints(parameters)


def link_constraints(
    parameters: Sequence[Parameter], sizes: dict[int, LinkSize], form: Form
) -> list[Constraint]:
    """One semidefinite constraint per link, less the margin of (38).

    The matrix is seen in units of the link's size, S^-1 P S^-1 with a diagonal S, which does not
    change its sign, but lets the solver treat a heavy link and a light one alike.
    """
    matrix, side = link_matrix_map(form)
    text = "pseudo-inertia >= 0" if form == "pseudo_inertia" else "[L, S(l)^T; S(l), m I] >= 0"
    constraints = []
    for link, size in sizes.items():
        unit = np.sqrt(size.mass) * np.array([size.radius] * 3 + [1.0] * (side - 3))
        weight = packed(1 / np.outer(unit, unit)) / packed(np.ones((side, side)))
        A = np.zeros((len(matrix), len(parameters)))
        A[:, link_places(parameters, link)] = matrix * weight[:, None]
        constraints.append(Constraint(link, text, side, A, MARGIN * packed(np.eye(side))))
    return constraints


def sign_constraints(parameters: Sequence[Parameter]) -> list[Constraint]:
    """Friction and rotor inertia must not be negative, (17)."""
    unit = np.eye(len(parameters))
    return [
        Constraint(p.index, f"{p.kind} >= 0", 0, unit[i : i + 1], np.array([MARGIN]))
        for i, p in enumerate(parameters)
        if p.kind in NON_NEGATIVE
    ]


def links_of(parameters: Sequence[Parameter]) -> list[int]:
    """Numbers of all links, from 1."""
    return sorted({p.index for p in parameters if p.kind == "inertial"})


def link_places(parameters: Sequence[Parameter], link: int) -> list[int]:
    """Places in delta of a link's ten inertial parameters."""
    return [i for i, p in enumerate(parameters) if p.kind == "inertial" and p.index == link]


@cache
def link_matrix_map(form: Form) -> tuple[Array, int]:
    """The linear map from a link's ten parameters to its packed matrix, and the matrix' side."""
    of_link = pseudo_inertia if form == "pseudo_inertia" else paper_matrix
    columns = [of_link(e) for e in np.eye(10)]
    return np.column_stack([packed(c) for c in columns]), len(columns[0])


def paper_matrix(delta: Array) -> Array:
    """D_k of (22), shape (6, 6), of one link's ten parameters."""
    xx, xy, xz, yy, yz, zz, x, y, z, m = delta
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.block([[tensor, skew.T], [skew, m * np.eye(3)]])


def packed(matrix: Array) -> Array:
    """Upper triangle of a symmetric matrix, column by column, shape (side (side + 1) / 2,)."""
    rows, columns, weights = _triangle(len(matrix))
    return matrix[rows, columns] * weights


def unpacked(values: Array, side: int) -> Array:
    """The symmetric matrices of `packed`, shape (..., side, side), of values (..., rows)."""
    rows, columns, weights = _triangle(side)
    matrices = np.empty((*values.shape[:-1], side, side))
    matrices[..., rows, columns] = matrices[..., columns, rows] = values / weights
    return matrices


@cache
def _triangle(side: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Rows and columns of the packed entries, and what each is multiplied by."""
    columns, rows = np.tril_indices(side)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2))


def smallest_eigenvalue(delta: Array, parameters: Sequence[Parameter]) -> float:
    """Smallest eigenvalue of all links' pseudo-inertias: not negative for possible links."""
    places = [link_places(parameters, link) for link in links_of(parameters)]
    matrices = [pseudo_inertia(delta[place]) for place in places]
    return float(min(np.linalg.eigvalsh(m)[0] for m in matrices))
