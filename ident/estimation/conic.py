"""Quadratic objectives over cones, handed to Clarabel as matrices without a modelling layer."""

# pyright: reportAttributeAccessIssue=false

import time
from collections.abc import Sequence
from dataclasses import dataclass

import clarabel  # ships no types
import numpy as np
from scipy import sparse

from ident.estimation.feasible_set import Constraint, unpacked
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

_TOLERANCE = 1e-8
_SOLVED = ("Solved", "AlmostSolved")


@dataclass(frozen=True)
class Inside:
    """`A x - b` in the cones of some constraints, one below the other.

    Attributes:
        constraints: whose cones these are; their own A and b are of delta.
        A: shape (rows, p).
        b: shape (rows,).
    """

    constraints: Sequence[Constraint]
    A: Array
    b: Array


def inside(constraints: Sequence[Constraint], start: Array, T: Array) -> Inside:
    """Constraints on delta = start + T x as constraints on x.

    Args:
        constraints: in terms of delta, shape (p,).
        start: shape (p,).
        T: shape (p, p).
    """
    A = np.concatenate([k.A for k in constraints])
    return Inside(constraints, A @ T, np.concatenate([k.b for k in constraints]) - A @ start)


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


def program(P: Array, c: Array, inside: Inside) -> Program:
    """The program of a dense objective.

    Args:
        P: shape (p, p), symmetric.
        c: shape (p,).
        inside: constraints of x.
    """
    cones = [
        clarabel.PSDTriangleConeT(k.side) if k.side else clarabel.NonnegativeConeT(len(k.b))
        for k in inside.constraints
    ]
    return Program(_sparse(np.triu(P)), c, _sparse(-inside.A), -inside.b, cones)


def _sparse(matrix: Array) -> sparse.csc_matrix:
    """A matrix without its zeros."""
    columns, rows = np.nonzero(matrix.T)
    ends = np.searchsorted(columns, np.arange(matrix.shape[1] + 1))
    return sparse.csc_matrix((matrix[rows, columns], rows, ends), shape=matrix.shape)


def _attempt(task: Program, refined: bool, scaled: bool) -> clarabel.DefaultSolution | None:
    """One run of the solver, with or without its own scaling of the rows and columns.

    That scaling helps where units differ, and stops the solver where an entry of P is so small that
    it only breaks ties: the scaling makes it as large as the others. None if the solver breaks off
    in the middle (its eigenvalues do not converge), which it tells by a panic of its own.
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.iterative_refinement_enable = refined
    settings.equilibrate_enable = scaled
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    solver = clarabel.DefaultSolver(task.P, task.c, task.A, task.b, task.cones, settings)
    try:
        return solver.solve()
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # it is no Exception, and cannot be imported
            raise
        return None


def solve(P: Array, c: Array, inside: Inside, what: str, refined: bool = True) -> Solution:
    """The program's solution.

    Args:
        P: shape (p, p), symmetric.
        c: shape (p,).
        inside: constraints of x.
        what: what is solved, for the message.
        refined: whether the solver repeats its linear solves to gain digits; what is well scaled
            does without.

    Raises:
        DataError: the solver gives up; the sentence names `what` and its status.
    """
    start = time.perf_counter()
    task = program(P, c, inside)
    found = _attempt(task, refined, scaled=True)
    if found is None or str(found.status) not in _SOLVED:
        found = _attempt(task, refined, scaled=False)
    status = "NumericalError" if found is None else str(found.status)
    if found is None or status not in _SOLVED:
        raise DataError(f"{what} has no solution: the solver stopped with {status}.")
    z, place = np.array(found.z), 0
    multipliers = []
    for k in inside.constraints:
        part = z[place : place + len(k.b)]
        multipliers.append(unpacked(part, k.side) if k.side else part)
        place += len(k.b)
    return Solution(np.array(found.x), tuple(multipliers), status, time.perf_counter() - start)
