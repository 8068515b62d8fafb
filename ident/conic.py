"""Quadratic objectives over cones, handed to Clarabel as matrices without a modelling layer."""

# pyright: reportAttributeAccessIssue=false

import time
from collections.abc import Sequence
from dataclasses import dataclass

import clarabel  # ships no types
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ident.feasible_set import Constraint, unpacked
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]

_TOLERANCE = 1e-8


@dataclass(frozen=True)
class Program:
    """Minimise x^T P x / 2 + c^T x subject to A x + s = b with s in a product of cones.

    Attributes:
        P: shape (p, p), upper triangle.
        c: shape (p,).
        A: shape (rows, p).
        b: shape (rows,).
        cones: Clarabel's cones, in the order of the rows.
    """

    P: sparse.csc_matrix
    c: Array
    A: sparse.csc_matrix
    b: Array
    cones: list


@dataclass(frozen=True)
class Solution:
    """What the solver found.

    Attributes:
        x: shape (p,).
        multipliers: one per constraint: shape (rows,), or (side, side) for a matrix.
        status: the solver's word.
        seconds: building and solving [s].
    """

    x: Array
    multipliers: tuple[Array, ...]
    status: str
    seconds: float


def program(P: Array, c: Array, constraints: Sequence[Constraint]) -> Program:
    """The program of a dense objective under constraints `A x - b in cone`.

    Args:
        P: shape (p, p), symmetric.
        c: shape (p,).
        constraints: in terms of x.
    """
    A = np.concatenate([-k.A for k in constraints])
    b = np.concatenate([-k.b for k in constraints])
    cones = [
        clarabel.PSDTriangleConeT(k.side) if k.side else clarabel.NonnegativeConeT(len(k.b))
        for k in constraints
    ]
    return Program(sparse.csc_matrix(np.triu(P)), c, sparse.csc_matrix(A), b, cones)


def solve(
    P: Array, c: Array, constraints: Sequence[Constraint], what: str, refined: bool = True
) -> Solution:
    """The program's solution.

    Args:
        P: shape (p, p), symmetric.
        c: shape (p,).
        constraints: in terms of x.
        what: what is solved, for the message.
        refined: whether the solver repeats its linear solves to gain digits; what is well scaled
            does without.

    Raises:
        DataError: the solver gives up; the sentence names `what` and its status.
    """
    start = time.perf_counter()
    task = program(P, c, constraints)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.iterative_refinement_enable = refined
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    found = clarabel.DefaultSolver(task.P, task.c, task.A, task.b, task.cones, settings).solve()
    status = str(found.status)
    if status not in ("Solved", "AlmostSolved"):
        raise DataError(f"{what} has no solution: the solver stopped with {status}.")
    z, place = np.array(found.z), 0
    multipliers = []
    for k in constraints:
        part = z[place : place + len(k.b)]
        multipliers.append(unpacked(part, k.side) if k.side else part)
        place += len(k.b)
    return Solution(np.array(found.x), tuple(multipliers), status, time.perf_counter() - start)
